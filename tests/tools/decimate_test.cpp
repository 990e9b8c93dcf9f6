// A probe of 16 kHz and a loop of 1 kHz.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

constexpr int kSamplesInATick = 16;
constexpr int kTicks = 400;

/// A press with a hum of 4.1 kHz, which every sixteenth sample turns into one of 100 Hz.
double humming_force_N(int sample) {
  const double time_s = sample / 16000.0;
  return 0.3 * std::min(time_s / 0.05, 1.0) +
         0.05 * std::sin(2.0 * std::numbers::pi * 4100.0 * time_s);
}

std::string humming_trace(const TemporaryFolder& folder) {
  std::string text = "time_s,force_N\n";
  for (int k = 0; k <= kSamplesInATick * kTicks; ++k) {
    text += fmt::format("{:.9f},{:.17g}\n", k / 16000.0, humming_force_N(k));
  }
  return "replay:" + folder.file("hum.csv", text);
}

std::string scene_with(const TemporaryFolder& folder, const std::string& decimate) {
  return folder.file(decimate + ".toml",
                     "preset = \"goodwin\"\n[probe]\ndecimate = \"" + decimate + "\"\n");
}

/// The force of each tick of a session, N, by its number.
std::map<int, double> forces_of(const std::string& session) {
  const auto run = run_program({"inspect", "session", session, "--stream", "ticks"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  std::istringstream lines(run.out);
  std::string line;
  std::getline(lines, line);
  std::vector<std::string> names;
  for (std::istringstream header(line); std::getline(header, line, ',');) names.push_back(line);
  std::map<int, double> forces;
  for (std::string row; std::getline(lines, row);) {
    std::map<std::string, double> cells;
    std::istringstream cell_text(row);
    for (std::size_t i = 0; std::getline(cell_text, line, ','); ++i) {
      cells[names[i]] = std::strtod(line.c_str(), nullptr);
    }
    forces[static_cast<int>(cells["number"])] = cells["force_mN"] / 1e3;
  }
  return forces;
}

TEST(Decimate, AMeanIsThatOfEveryTicksSamplesAndReplaysToTheSameSpikes) {
  const TemporaryFolder folder;
  const std::string probe = humming_trace(folder);
  const std::string scene = scene_with(folder, "mean");
  std::string spikes;
  for (const char* chunk : {"1", "7", "1000"}) {
    const std::string name = folder.path(std::string("s") + chunk);
    const auto run =
        run_program({"run", scene, "--fast", "--json", "--probe", probe + "?chunk=" + chunk,
                     "--sink", "xdf:" + name + ".xdf", "--sink", "csv:" + name + ".csv"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto summary = nlohmann::json::parse(run.out)["probes"][0];
    EXPECT_EQ(summary["decimate"], "mean");
    EXPECT_NEAR(summary["samples_per_tick"].get<double>(), 16.0, 0.1);
    if (spikes.empty()) spikes = read_file(name + ".csv");
    EXPECT_EQ(read_file(name + ".csv"), spikes) << chunk;
  }
  EXPECT_GT(spikes.size(), 500U);
  const std::string session = folder.path("s7.xdf");
  const auto replayed = run_program({"replay", session});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.out << replayed.err;

  const std::map<int, double> forces = forces_of(session);
  ASSERT_GE(forces.size(), static_cast<std::size_t>(kTicks - 1));
  for (int tick = 2; tick < kTicks; ++tick) {
    double sum = 0.0;
    for (int k = 0; k < kSamplesInATick; ++k) {
      sum += humming_force_N(kSamplesInATick * tick - k);
    }
    ASSERT_NEAR(forces.at(tick), sum / kSamplesInATick, 1e-12) << tick;
  }
  // Every sample is in the session: run again as a probe, it gives the same spikes.
  const auto again = run_program({"run", scene, "--fast", "--probe", "replay:" + session, "--sink",
                                  "csv:" + folder.path("again.csv")});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(read_file(folder.path("again.csv")), spikes);
}

TEST(Decimate, WhatTheMeanTakesAwayIsInTheLastSample) {
  const TemporaryFolder folder;
  const std::string probe = humming_trace(folder);
  std::map<std::string, double> ripples_N;
  for (const char* decimate : {"last", "mean"}) {
    const auto run = run_program({"run", scene_with(folder, decimate), "--fast", "--probe", probe,
                                  "--sink", "xdf:" + folder.path(decimate) + ".xdf"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.out.find("16 samples in a tick"), std::string::npos) << run.out;
    for (const auto& [tick, force_N] : forces_of(folder.path(decimate) + ".xdf")) {
      if (tick < 60 || tick >= kTicks) continue;
      ripples_N[decimate] = std::max(ripples_N[decimate], std::fabs(force_N - 0.3));
    }
  }
  EXPECT_GT(ripples_N["last"], 0.045);
  // sin(16 π f / 16 kHz) / (16 sin(π f / 16 kHz)) of the amplitude at 4.1 kHz: 0.027.
  EXPECT_LT(ripples_N["mean"], 0.0015);
  EXPECT_GT(ripples_N["mean"], 0.0010);
}

}  // namespace
}  // namespace merkel
