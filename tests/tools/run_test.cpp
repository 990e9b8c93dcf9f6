#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

const std::string kTraces = "tests/traces/";

/// The spike file of a fast run of a trace.
std::string spikes_of(const std::string& probe, const std::vector<std::string>& more = {}) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments = {"run", "--fast", "--probe",
                                        probe, "--sink", "csv:" + folder.path("s.csv")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const auto run = run_program(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return read_file(folder.path("s.csv"));
}

TEST(Run, ChunksOfSamplesDoNotChangeAByte) {
  for (const char* trace : {"ramp_and_hold.csv", "taps.csv", "slide.csv", "faulty.csv"}) {
    const std::string one = spikes_of("replay:" + kTraces + trace + "?chunk=1");
    EXPECT_GT(one.size(), 300U) << trace;
    EXPECT_EQ(one, spikes_of("replay:" + kTraces + trace + "?chunk=7")) << trace;
    EXPECT_EQ(one, spikes_of("replay:" + kTraces + trace + "?chunk=1000")) << trace;
  }
}

TEST(Run, RealTimePacingWritesTheBytesOfAFastRun) {
  const TemporaryFolder folder;
  const std::string probe = "replay:" + kTraces + "ramp_and_hold.csv";
  const auto run = run_program(
      {"run", "--probe", probe, "--duration-s", "1", "--sink", "csv:" + folder.path("s.csv")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string fast = spikes_of(probe, {"--duration-s", "1"});
  EXPECT_EQ(read_file(folder.path("s.csv")), fast);
  EXPECT_GT(fast.size(), 500U);
}

TEST(Run, TheBuiltInPressIsTheBundledRampAndHold) {
  EXPECT_EQ(spikes_of("sim:ramp"), spikes_of("replay:" + kTraces + "ramp_and_hold.csv"));
}

TEST(Run, SeedsChangeTheReceptors) {
  const std::string probe = "replay:" + kTraces + "ramp_and_hold.csv";
  const std::string one = spikes_of(probe, {"--seed", "1"});
  EXPECT_EQ(one, spikes_of(probe));
  EXPECT_NE(one, spikes_of(probe, {"--seed", "2"}));
}

TEST(Run, SpikeFilesAreInOrderWithTheContractsHeader) {
  const std::string spikes = spikes_of("replay:" + kTraces + "slide.csv");
  EXPECT_EQ(spikes.substr(0, 14), "time_s,neuron\n");
  std::istringstream lines(spikes.substr(14));
  std::string line;
  std::pair<double, int> last{-1.0, 0};
  while (std::getline(lines, line)) {
    const auto comma = line.find(',');
    EXPECT_GE(comma - line.find('.') - 1, 9U);
    const std::pair<double, int> now{std::stod(line), std::stoi(line.substr(comma + 1))};
    EXPECT_LT(last, now);
    EXPECT_GE(now.second, 1);
    EXPECT_LE(now.second, 20);
    last = now;
  }
}

TEST(Run, TheSummaryAddsUp) {
  const auto run = run_program({"run", "--fast", "--json", "--probe",
                                "replay:" + kTraces + "faulty.csv", "--sink", "csv:/dev/null"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto summary = nlohmann::json::parse(run.out);
  const auto& probe = summary["probes"][0];
  EXPECT_EQ(probe["samples_in"].get<int>(), probe["used"].get<int>() + probe["late"].get<int>() +
                                                probe["dropped"].get<int>() +
                                                probe["unused"].get<int>());
  EXPECT_GT(probe["releases"].get<int>(), 0);
  EXPECT_FALSE(probe["deepest_press"]["valid"].get<bool>());
  EXPECT_EQ(summary["sinks"][0]["delivered"], summary["spikes"]);
  int spikes = 0;
  int receptors = 0;
  for (const auto& neuron : summary["neurons"]) {
    spikes += neuron["spikes"].get<int>();
    receptors += neuron["receptors"].get<int>();
    EXPECT_NEAR(neuron["rate_hz"].get<double>(),
                neuron["spikes"].get<int>() / summary["simulated_s"].get<double>(), 1e-9);
  }
  EXPECT_EQ(spikes, summary["spikes"].get<int>());
  EXPECT_EQ(receptors, 450);
}

TEST(Run, ASceneMayNameProbeAndSink) {
  const TemporaryFolder folder;
  const std::string scene =
      folder.file("s.toml",
                  "[probe]\nuri = \"replay:tests/traces/taps.csv\"\nradius_mm = 3\n[[sink]]\nuri = "
                  "\"csv:" +
                      folder.path("s.csv") + "\"\n");
  const auto run = run_program({"run", scene, "--fast"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("sink csv:"), std::string::npos);
  EXPECT_GT(read_file(folder.path("s.csv")).size(), 100U);
}

TEST(Run, PresetsRunByName) {
  const auto wide = run_program({"run", "paper-wide", "--fast"});
  EXPECT_EQ(wide.exit_code, 0) << wide.err;
  EXPECT_NE(wide.out, run_program({"run", "paper", "--fast"}).out);
}

TEST(Run, BadInputGetsOneSentenceExit2AndNoFile) {
  const TemporaryFolder folder;
  const std::string spikes = folder.path("s.csv");
  std::string late_fault = "time_s,depth_mm\n";
  for (int k = 0; k < 3000; ++k) late_fault += std::to_string(k * 0.001) + ",1.5\n";
  late_fault += "3.5,nan\n";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--probe", "replay:" + folder.path("none.csv")}, "cannot read"},
      {{"--probe", "replay:" + folder.file("empty.csv", "")}, "is empty"},
      {{"--probe", "replay:" + folder.file("late.csv", late_fault)}, "late.csv:3002: depth_mm"},
      {{"--probe", "sim:jump"}, "sim:ramp"},
      {{folder.file("a.toml", "[skin]\npoison_ratio = 1\n")}, "did you mean poisson_ratio"},
      {{folder.file("b.toml", "[probe]\nradius_mm = -1\n")}, "b.toml:2: probe.radius_mm"},
      {{folder.path("none.toml")}, "cannot read the scene"},
      {{"--sink", "csv:" + folder.path("no/folder/s.csv")}, "make its folder first"},
      {{"--sink", "csv:" + folder.file("there.csv", "old")}, "--overwrite"},
      {{folder.file("c.toml", "[probe]\ncontrol = \"force\"\n")}, "does not measure"},
      {{"--duration-s", "-1"}, "--duration-s"},
  };
  for (const auto& [arguments, sentence] : cases) {
    std::vector<std::string> all = {"run", "--fast", "--sink", "csv:" + spikes, "--overwrite"};
    if (sentence == "--overwrite") all.pop_back();
    all.insert(all.end(), arguments.begin(), arguments.end());
    const auto run = run_program(all);
    EXPECT_EQ(run.exit_code, 2) << sentence;
    EXPECT_NE(run.err.find(sentence), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(spikes)) << sentence;
    std::filesystem::remove(spikes + ".part");
  }
}

TEST(Run, AFullDiskIsAnErrorWithACount) {
  const auto run = run_program({"run", "--fast", "--sink", "csv:/dev/full"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("No space left on device"), std::string::npos);
  EXPECT_NE(run.out.find("0 delivered"), std::string::npos);
  EXPECT_NE(run.out.find("lost"), std::string::npos);
}

TEST(Run, SpikesOnStandardOutputKeepTheSummaryAway) {
  const auto run = run_program({"run", "--fast", "--sink", "csv:-"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.out.substr(0, 14), "time_s,neuron\n");
  EXPECT_EQ(run.out.find("simulated"), std::string::npos);
  EXPECT_NE(run.err.find("simulated"), std::string::npos);
}

#ifndef MERKEL_SANITIZED  // sanitizers keep freed memory
TEST(Run, MemoryDoesNotGrowWithTheTrace) {
  const auto run_for = [](const char* seconds) {
    return run_program(
               {"run", "--fast", "--probe", std::string("sim:ramp?depth_mm=0&hold_s=") + seconds})
        .peak_memory_MiB;
  };
  const double brief = run_for("10");
  EXPECT_LT(run_for("100"), brief + 2.0);
}
#endif

}  // namespace
}  // namespace merkel
