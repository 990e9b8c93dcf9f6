// A sensor that drifts, through the whole program and its sessions; tests/readings has the bounds.
#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "drivers/sessions/session_reader.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

constexpr const char* kDriftScene = R"(preset = "goodwin"
[probe]
contact_N = 0.012
zero = "track"
[[electrode]]
name = "linear"
field_mm = [15, 10, 4]
encoder = "linear"
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[stimulation]
update_ms = 10
phase_us = 200
max_charge_nC = 16
max_total_uA = 250
watchdog_ms = 100
max_slope_uA_per_s = 20000
)";

/// A force with a noise of 2 mN, as a trace.
std::string noisy_trace(double seconds, const std::function<double(double)>& force_mN) {
  std::string text = "time_s,force_N\n";
  std::uint64_t state = 99;
  for (int i = 0; i < static_cast<int>(seconds * 500.0); ++i) {
    double sum = -6.0;
    for (int k = 0; k < 12; ++k) {
      state = state * 6364136223846793005U + 1442695040888963407U;
      sum += static_cast<double>(state >> 11U) * 0x1p-53;
    }
    text += fmt::format("{:.3f},{:.6f}\n", i * 0.002, 1e-3 * (force_mN(i * 0.002) + 2.0 * sum));
  }
  return text;
}

struct DriftRun {
  std::vector<double> spikes_s;
  std::vector<std::pair<double, double>> currents;  ///< s, µA
  std::string out;

  [[nodiscard]] std::size_t spikes_from(double from_s, double to_s) const {
    return static_cast<std::size_t>(std::count_if(
        spikes_s.begin(), spikes_s.end(), [=](double t) { return t >= from_s && t < to_s; }));
  }
};

DriftRun run_drift(const TemporaryFolder& folder, const std::string& probe) {
  const std::string scene = folder.file("drift.toml", kDriftScene);
  const auto run =
      run_program({"run", scene, "--fast", "--overwrite", "--probe", probe, "--sink",
                   "csv:" + folder.path("s.csv"), "--sink", "stim-csv:" + folder.path("stim.csv"),
                   "--sink", "xdf:" + folder.path("s.xdf")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  DriftRun made{.spikes_s = {}, .currents = {}, .out = run.out + run.err};
  std::istringstream spikes(read_file(folder.path("s.csv")));
  for (std::string line; std::getline(spikes, line);) {
    if (std::isdigit(static_cast<unsigned char>(line[0])) != 0) {
      made.spikes_s.push_back(std::atof(line.c_str()));
    }
  }
  std::istringstream commands(read_file(folder.path("stim.csv")));
  for (std::string line; std::getline(commands, line);) {
    if (std::isdigit(static_cast<unsigned char>(line[0])) == 0) continue;
    std::size_t field = 0;
    for (int k = 0; k < 3; ++k) field = line.find(',', field) + 1;
    made.currents.emplace_back(std::atof(line.c_str()), std::atof(line.c_str() + field));
  }
  return made;
}

/// A press of 1 s on a zero that drifts.
std::string press_on_a_drift() {
  return noisy_trace(30.0, [](double time_s) {
    return (time_s > 20.0 && time_s < 21.0 ? 300.0 : 0.0) + 0.5 * time_s;
  });
}

TEST(Drift, ASessionKeepsTheZerosAndItsReplayIsIdentical) {
  const TemporaryFolder folder;
  const std::string trace = folder.file("t.csv", press_on_a_drift());
  const DriftRun made = run_drift(folder, "replay:" + trace);
  ASSERT_GT(made.spikes_s.size(), 20U);
  const std::string session = folder.file("first.xdf", read_file(folder.path("s.xdf")));
  const auto replay = run_program({"replay", session});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  const DriftRun again = run_drift(folder, "replay:" + session);
  EXPECT_EQ(again.spikes_s, made.spikes_s);
  EXPECT_EQ(again.currents, made.currents);
  auto reader = SessionReader::open(session);
  ASSERT_TRUE(reader);
  double largest_mN = 0.0;
  double touching_s = 0.0;
  SessionChunk chunk;
  while (*reader->next(chunk)) {
    for (const DeliveredSample& item : chunk.samples) {
      largest_mN = std::max(largest_mN, item.sample.zero_mN);
      touching_s += touches(item.sample) ? 0.002 : 0.0;
    }
  }
  EXPECT_NEAR(largest_mN, 15.0, 2.0);
  EXPECT_NEAR(touching_s, 1.0, 0.03);
}

TEST(Drift, ATraceOfARunIsNotTrackedAgain) {
  const TemporaryFolder folder;
  const std::string trace = folder.file("t.csv", press_on_a_drift());
  const DriftRun made = run_drift(folder, "replay:" + trace);
  ASSERT_GT(made.spikes_s.size(), 20U);
  const std::string recorded = folder.path("recorded.csv");
  ASSERT_EQ(run_program({"export", folder.path("s.xdf"), "--sink", "trace:" + recorded}).exit_code,
            0);
  EXPECT_EQ(run_drift(folder, "replay:" + recorded).spikes_s, made.spikes_s);
  const std::string session = folder.path("recorded.xdf");
  ASSERT_EQ(run_program({"record", "replay:" + recorded, session}).exit_code, 0);
  EXPECT_EQ(run_drift(folder, "replay:" + session).spikes_s, made.spikes_s);
}

TEST(Drift, InDoubtTheTouchStaysAndStimulationIsSuspended) {
  const TemporaryFolder folder;
  const std::string trace =
      folder.file("t.csv", noisy_trace(100.0, [](double time_s) {
                    const bool light = time_s > 60.0 && time_s < 80.0;
                    return time_s < 5.0 || time_s > 90.0 ? 0.0 : light ? 50.0 : 500.0;
                  }));
  const DriftRun made = run_drift(folder, "replay:" + trace);
  EXPECT_TRUE(has(made.out, "the zero of replay:" + trace + " was uncertain for 1")) << made.out;
  EXPECT_GT(made.spikes_from(65.0, 80.0), 10U);  // the touch stays
  double suspended_uA = 0.0;
  double again_uA = 0.0;
  for (const auto& [time_s, uA] : made.currents) {
    if (time_s > 63.0 && time_s < 80.0) suspended_uA = std::max(suspended_uA, uA);
    if (time_s > 82.0 && time_s < 90.0) again_uA = std::max(again_uA, uA);
  }
  EXPECT_EQ(suspended_uA, 0.0);
  EXPECT_GT(again_uA, 20.0);
  auto reader = SessionReader::open(folder.path("s.xdf"));
  ASSERT_TRUE(reader);
  std::vector<LoopEvent::Kind> events;
  SessionChunk chunk;
  while (*reader->next(chunk)) {
    for (const LoopEvent& event : chunk.events) events.push_back(event.kind);
  }
  const std::vector<LoopEvent::Kind> expected = {LoopEvent::Kind::kZeroUncertain,
                                                 LoopEvent::Kind::kZeroCertain};
  EXPECT_EQ(events, expected);
  const std::string session = folder.file("first.xdf", read_file(folder.path("s.xdf")));
  const DriftRun again = run_drift(folder, "replay:" + session);
  EXPECT_EQ(again.spikes_s, made.spikes_s);
  EXPECT_EQ(again.currents, made.currents);
}

}  // namespace
}  // namespace merkel
