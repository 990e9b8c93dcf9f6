#include "tools/self_test/self_test.hpp"

#include <algorithm>
#include <cstdlib>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "core/simd/simd_target.hpp"
#include "drivers/files/embedded_text.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kGoldenSpikes;
namespace {

TEST(SelfTest, HasTheGoldenSpikesOfEveryPreset) {
  std::vector<std::string> names;
  for (const EmbeddedText& golden : kGoldenSpikes) {
    names.emplace_back(golden.name.substr(0, golden.name.find('.')));
    EXPECT_EQ(golden.text, read_file("tests/golden/" + std::string(golden.name)));
  }
  std::vector<std::string> presets = preset_names();
  std::sort(names.begin(), names.end());
  std::sort(presets.begin(), presets.end());
  EXPECT_EQ(names, presets);
}

TEST(SelfTest, NamesTheFirstRowThatDiffers) {
  const std::string_view golden = "# a comment\ntime_s,neuron\n0.1,3\n0.2,4\n";
  EXPECT_EQ(spike_rows_differ(golden, "# another\ntime_s,neuron\n0.1,3\n0.2,4"), "");
  EXPECT_EQ(spike_rows_differ(golden, "time_s,neuron\n0.1,3\n0.3,4\n"),
            "row 2 is 0.3,4, not 0.2,4");
  EXPECT_EQ(spike_rows_differ(golden, "time_s,neuron\n0.1,3\n"), "row 2 is missing, not 0.2,4");
  EXPECT_EQ(spike_rows_differ(golden, "time_s,neuron\n0.1,3\n0.2,4\n0.3,1\n"),
            "row 3 is 0.3,1, not missing");
}

TEST(SelfTest, AnInstructionSetThatTheProcessorLacksFails) {
  const TemporaryFolder folder;
  const SelfCheck check = check_golden_spikes("no-such-set", folder.path(""));
  EXPECT_FALSE(check.passed);
  EXPECT_NE(check.finding.find("does not support"), std::string::npos) << check.finding;
}

TEST(SelfTest, AHostWithoutPseudoTerminalsIsNotAFaultOfTheCopy) {
  // A namespace whose /dev/ptmx is no terminal; where the host allows no namespaces, nothing is
  // shown.
  const std::string hidden =
      "unshare --user --map-root-user --mount sh -c 'mount --bind /dev/null /dev/ptmx && ";
  if (std::system((hidden + "true' 2>/dev/null").c_str()) != 0) GTEST_SKIP();
  const TemporaryFolder folder;
  const std::string command =
      hidden + MERKEL_PROGRAM + " self-test' >" + folder.path("out") + " 2>" + folder.path("err");
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_NE(
      read_file(folder.path("out")).find("not run a device on a pseudo-terminal: cannot make"),
      std::string::npos)
      << read_file(folder.path("out"));
  EXPECT_NE(read_file(folder.path("err")).find("the host refused a check"), std::string::npos);
}

TEST(SelfTest, AFolderThatCannotBeWrittenFails) {
  const SelfCheck check = check_golden_spikes(simd_target(), "/proc/none");
  EXPECT_FALSE(check.passed);
  EXPECT_FALSE(check_loopback_device("/proc/none").passed);
}

TEST(SelfTest, PassesWithEveryInstructionSetAndALoopbackDevice) {
  const ProgramRun run = run_program({"self-test", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  const auto result = nlohmann::json::parse(run.out);
  EXPECT_TRUE(result["passed"]);
  EXPECT_EQ(result["checks"].size(), simd_targets().size() + 1);
  for (const auto& check : result["checks"]) EXPECT_TRUE(check["passed"]) << check.dump();
}

}  // namespace
}  // namespace merkel
