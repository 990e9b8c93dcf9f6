// An output never destroys an input, whatever the names and the flags.
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/files/output_file.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

std::string refusal_of(const std::string& sink, const SinkSetup& setup) {
  const auto opened = open_sink(sink, setup);
  return opened ? "" : opened.error().sentence;
}

TEST(Overwrite, AnOutputThatIsAnInputIsRefusedByItsIdentity) {
  const TemporaryFolder folder;
  const std::string input = folder.file("in.csv", "time_s,depth_mm\n0,1\n1,1\n");
  std::filesystem::create_directories(folder.path("sub"));
  std::filesystem::create_symlink(input, folder.path("link.csv"));
  std::filesystem::create_hard_link(input, folder.path("hard.csv"));
  const std::vector<std::string> names = {input, folder.path("sub/../in.csv"),
                                          folder.path("./in.csv"), folder.path("link.csv"),
                                          folder.path("hard.csv")};
  SinkSetup of_probe{.neurons = 1, .overwrite = true, .run = {}};
  of_probe.run.probes = {{.uri = "replay:" + input + "?live=1"}};
  SinkSetup of_fused = of_probe;
  of_fused.run.probes = {{.uri = "fused:sim:ramp|replay:" + input}};
  SinkSetup of_calibration{.neurons = 1, .overwrite = true, .run = {}};
  of_calibration.run.probes = {{.uri = "sim:ramp", .calibration_file = input}};
  const SinkSetup of_scene{.neurons = 1, .overwrite = true, .run = {}, .inputs = {input}};
  SinkSetup of_option = of_probe;
  of_option.run.probes = {{.uri = "serial:/dev/ttyS9?protocol=hbf1&calibration=" + input}};
  for (const SinkSetup& setup : {of_probe, of_fused, of_calibration, of_option, of_scene}) {
    for (const std::string& name : names) {
      for (const char* scheme : {"csv:", "gdf:", "xdf:", "stim-csv:"}) {
        EXPECT_NE(refusal_of(scheme + name, setup).find("would destroy its input"),
                  std::string::npos)
            << scheme << name;
      }
    }
    EXPECT_EQ(refusal_of("csv:" + folder.path("out.csv"), setup), "");
  }
  EXPECT_EQ(std::filesystem::file_size(input), 24U);
}

}  // namespace
}  // namespace merkel
