// An output never destroys an input, whatever the names and the flags.
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/files/input_file.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

std::string refusal_of(const std::string& sink) {
  const auto opened = open_sink(sink, 1, true);
  return opened ? "" : opened.error().sentence;
}

bool destroys(const std::string& sink) {
  return refusal_of(sink).find("would destroy its input") != std::string::npos;
}

TEST(Overwrite, AnOutputThatIsAnInputIsRefusedByItsIdentity) {
  const TemporaryFolder folder;
  const std::string input = folder.file("in.csv", "time_s,depth_mm\n0,1\n1,1\n");
  std::filesystem::create_directories(folder.path("sub"));
  std::filesystem::create_symlink(input, folder.path("link.csv"));
  std::filesystem::create_hard_link(input, folder.path("hard.csv"));
  const std::string names[] = {input, folder.path("sub/../in.csv"), folder.path("./in.csv"),
                               folder.path("link.csv"), folder.path("hard.csv")};
  for (const std::string& read : names) {
    const ReadFiles files;
    ASSERT_TRUE(open_probe("replay:" + read + "?live=1"));
    for (const std::string& name : names) {
      for (const char* scheme : {"csv:", "gdf:", "xdf:", "trace:"}) {
        EXPECT_TRUE(destroys(scheme + name)) << scheme << name << ": " << refusal_of(scheme + name);
      }
    }
    EXPECT_EQ(refusal_of("csv:" + folder.path("out.csv")), "");
  }
  EXPECT_EQ(std::filesystem::file_size(input), 24U);
}

TEST(Overwrite, OnlyFilesOfTheCommandAreProtected) {
  const TemporaryFolder folder;
  const std::string early = folder.file("early.csv", "1");
  const std::string own = folder.file("own.csv", "1");
  const std::string late = folder.file("late.csv", "1");
  ASSERT_TRUE(read_whole_file(early, "file", 1));
  {
    ReadFiles files;
    ASSERT_TRUE(read_whole_file(own, "file", 1));
    files.complete();
    ASSERT_TRUE(read_whole_file(late, "file", 1));
    EXPECT_FALSE(destroys("csv:" + early));
    EXPECT_TRUE(destroys("csv:" + own));
    EXPECT_FALSE(destroys("csv:" + late));
  }
  EXPECT_FALSE(destroys("csv:" + own));
}

TEST(Overwrite, AnInputThatWasRemovedProtectsNothing) {
  const TemporaryFolder folder;
  const ReadFiles files;
  const std::string input = folder.file("in.csv", "1");
  ASSERT_TRUE(read_whole_file(input, "file", 1));
  std::filesystem::rename(input, folder.path("moved.csv"));
  EXPECT_FALSE(destroys("csv:" + input));
}

TEST(Overwrite, WholeFilesAreReadWithinTheirLimitOrRefused) {
  const TemporaryFolder folder;
  const std::string exact = folder.file("exact", "abc");
  const auto refusal = [](const std::string& path, std::size_t limit) {
    const auto read = read_whole_file(path, "scene", limit);
    return read ? "" : read.error().sentence;
  };
  EXPECT_EQ(read_whole_file(exact, "scene", 3).value_or(""), "abc");
  EXPECT_NE(refusal(exact, 2).find("larger than"), std::string::npos);
  EXPECT_NE(refusal("/dev/zero", 1U << 20U).find("larger than 1 MiB"), std::string::npos);
  EXPECT_NE(refusal(folder.path(""), 9).find("is a directory"), std::string::npos);
  EXPECT_NE(refusal("/proc/self/mem", 9).find("is it a regular file?"), std::string::npos);
  EXPECT_NE(refusal(folder.path("none"), 9).find("No such file"), std::string::npos);
}

}  // namespace
}  // namespace merkel
