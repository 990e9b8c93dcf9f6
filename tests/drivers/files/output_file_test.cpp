#include "drivers/files/output_file.hpp"

#include <cerrno>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/files/file_rename.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

TEST(OutputFile, DoesNotLookWholeBeforeItIsClosed) {
  const TemporaryFolder folder;
  auto file = OutputFile::create(folder.path("out.csv"), false);
  ASSERT_TRUE(file);
  EXPECT_TRUE(file->write("a,b\n"));
  EXPECT_TRUE(file->flush());
  EXPECT_EQ(read_file(folder.path("out.csv.part")), "a,b\n");
  EXPECT_FALSE(std::filesystem::exists(folder.path("out.csv")));
  EXPECT_TRUE(file->close());
  EXPECT_EQ(read_file(folder.path("out.csv")), "a,b\n");
  EXPECT_FALSE(std::filesystem::exists(folder.path("out.csv.part")));
}

TEST(FileRename, ReplacesOnlyWhereItMay) {
  const TemporaryFolder folder;
  const std::string first = folder.file("first", "1");
  const std::string second = folder.file("second", "2");
  EXPECT_EQ(rename_to(first, second, false), EEXIST);
  EXPECT_EQ(read_file(second), "2");
  errno = EIO;  // of something before
  EXPECT_EQ(rename_to(first, second, true), 0);
  EXPECT_EQ(read_file(second), "1");
  EXPECT_EQ(rename_to(first, second, true), ENOENT);
  EXPECT_EQ(rename_to(second, first, false), 0);
  EXPECT_EQ(read_file(first), "1");
}

TEST(OutputFile, AnAbandonedFileKeepsItsPartName) {
  const TemporaryFolder folder;
  { static_cast<void>(OutputFile::create(folder.path("out"), false)->write("kept")); }
  EXPECT_EQ(read_file(folder.path("out.part")), "kept");
  EXPECT_FALSE(std::filesystem::exists(folder.path("out")));
}

TEST(OutputFile, DoesNotReplaceAFileUnasked) {
  const TemporaryFolder folder;
  const std::string path = folder.file("out", "precious");
  const auto refused = OutputFile::create(path, false);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().sentence.find("--overwrite"), std::string::npos);
  auto allowed = OutputFile::create(path, true);
  ASSERT_TRUE(allowed);
  EXPECT_TRUE(allowed->write("new") && allowed->close());
  EXPECT_EQ(read_file(path), "new");
}

TEST(OutputFile, KeepsWhatAKilledRunHasLeftUnderANameOfItsOwn) {
  const TemporaryFolder folder;
  for (const bool overwrite : {false, true}) {
    static_cast<void>(folder.file("out.csv.part", "half a run"));
    std::string notice;
    auto file = OutputFile::create(folder.path("out.csv"), overwrite,
                                   [&](const std::string& sentence) { notice = sentence; });
    ASSERT_TRUE(file) << file.error().sentence;
    EXPECT_EQ(read_file(file->recovered()), "half a run");
    EXPECT_NE(notice.find(file->recovered()), std::string::npos) << notice;
    EXPECT_TRUE(file->recovered().ends_with(".csv")) << file->recovered();
    EXPECT_TRUE(file->write("new") && file->close());
    EXPECT_EQ(read_file(folder.path("out.csv")), "new");
  }
}

TEST(OutputFile, DoesNotReplaceAFileThatAppearsWhileItWrites) {
  const TemporaryFolder folder;
  auto file = OutputFile::create(folder.path("out"), false);
  ASSERT_TRUE(file && file->write("spikes"));
  static_cast<void>(folder.file("out", "precious"));
  EXPECT_FALSE(file->close());
  EXPECT_NE(file->error().find("is in " + folder.path("out.part")), std::string::npos)
      << file->error();
  EXPECT_EQ(read_file(folder.path("out")), "precious");
  EXPECT_EQ(read_file(folder.path("out.part")), "spikes");
}

TEST(OutputFile, FollowsNoLink) {
  const TemporaryFolder folder;
  const std::string precious = folder.file("precious", "mine");
  std::filesystem::create_symlink(precious, folder.path("out.part"));
  EXPECT_FALSE(OutputFile::create(folder.path("out"), true));
  EXPECT_EQ(read_file(precious), "mine");
}

TEST(OutputFile, WritesOutWithin200MsWithoutBeingAsked) {
  const TemporaryFolder folder;
  auto file = OutputFile::create(folder.path("out"), false);
  ASSERT_TRUE(file && file->write("a\n"));
  std::this_thread::sleep_for(OutputFile::kFlushAfter);
  EXPECT_TRUE(file->write("b\n"));
  EXPECT_EQ(read_file(folder.path("out.part")), "a\nb\n");
}

TEST(OutputFile, AWriteToAnUnreadPipeCanBeAborted) {
  const TemporaryFolder folder;
  const std::string pipe = folder.path("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDWR | O_NONBLOCK);
  auto file = OutputFile::create(pipe, false);
  ASSERT_TRUE(file) << file.error().sentence;
  std::jthread impatient([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds{50});
    file->give_up();
  });
  bool written = true;
  for (int i = 0; i < 100 && written; ++i) written = file->write(std::string(65536, 'x'));
  EXPECT_FALSE(written);
  EXPECT_NE(file->error().find("stopped reading"), std::string::npos) << file->error();
  ::close(reader);
}

TEST(OutputFile, AHeaderAloneIsNotKept) {
  const TemporaryFolder folder;
  const auto begin = [&](const std::string& name) {
    auto file = OutputFile::create(folder.path(name), false);
    EXPECT_TRUE(file->write("time_s,neuron\n"));
    file->end_header();
    return std::move(*file);
  };
  { const OutputFile refused = begin("refused"); }
  EXPECT_FALSE(std::filesystem::exists(folder.path("refused.part")));
  { EXPECT_TRUE(begin("started").write("0.1,1\n")); }
  EXPECT_EQ(read_file(folder.path("started.part")), "time_s,neuron\n0.1,1\n");
  EXPECT_TRUE(begin("empty").close());
  EXPECT_EQ(read_file(folder.path("empty")), "time_s,neuron\n");
}

TEST(OutputFile, HasOneWriterOnly) {
  const TemporaryFolder folder;
  auto first = OutputFile::create(folder.path("out"), true);
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->write("first") && first->flush());
  const auto second = OutputFile::create(folder.path("out"), true);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().sentence.find("another sink"), std::string::npos);
  EXPECT_TRUE(first->close());
  EXPECT_EQ(read_file(folder.path("out")), "first");
}

TEST(OutputFile, NamesWhatStandsInTheWay) {
  const TemporaryFolder folder;
  EXPECT_NE(OutputFile::create(folder.path("no/such/out"), false)
                .error()
                .sentence.find("create its folder first"),
            std::string::npos);
  EXPECT_NE(OutputFile::create(folder.path(""), false).error().sentence.find("directory"),
            std::string::npos);
  EXPECT_FALSE(OutputFile::create("", false));
}

TEST(OutputFile, AFullDeviceIsAnErrorThatStays) {
  auto file = OutputFile::create("/dev/full", false);
  ASSERT_TRUE(file);
  EXPECT_TRUE(file->write("x"));
  EXPECT_FALSE(file->settled());
  EXPECT_FALSE(file->flush());
  EXPECT_NE(file->error().find("No space left"), std::string::npos);
  EXPECT_FALSE(file->write("y"));
  EXPECT_FALSE(file->close());
}

}  // namespace
}  // namespace merkel
