// Stimulation commands through the whole program: scene, run, sinks, sessions, replay.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/sample_stream.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {
namespace {

constexpr auto kScene = R"(preset = "goodwin"
[[electrode]]
name = "rate"
field_mm = [15, 10, 4]
encoder = "rate"
full_rate_Hz = 50
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[[electrode]]
name = "recruited"
field_mm = [15, 10, 4]
encoder = "recruited"
amplitude_uA = [20, 80]
frequency_Hz = [50, 200]
[[electrode]]
name = "pulses"
field_mm = [15, 10, 2]
encoder = "pulse_per_spike"
amplitude_uA = [60, 60]
frequency_Hz = [0, 300]
[[electrode]]
name = "linear"
field_mm = [15, 10, 4]
encoder = "linear"
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[[electrode]]
name = "okorokova"
field_mm = [15, 10, 4]
encoder = "okorokova"
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

std::vector<std::vector<std::string>> rows_of(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> fields(1);
    for (const char c : line) {
      if (c == ',') {
        fields.emplace_back();
      } else {
        fields.back() += c;
      }
    }
    rows.push_back(std::move(fields));
  }
  return rows;
}

TEST(Encoding, EverySinkAndTheReplayGiveTheSameCommands) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kScene);
  const std::string live = folder.path("live.csv");
  const std::string session = folder.path("session.xdf");
  const ProgramRun run =
      run_program({"run", scene, "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink",
                   "stim-csv:" + live, "--sink", "xdf:" + session, "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;

  const ProgramRun inspected =
      run_program({"inspect", "encoding", scene, "--probe", "replay:tests/traces/taps.csv"});
  ASSERT_EQ(inspected.exit_code, 0) << inspected.err;
  EXPECT_TRUE(inspected.out == read_file(live));

  const std::string replayed = folder.path("replayed.csv");
  const ProgramRun replay = run_program({"replay", session, "--sink", "stim-csv:" + replayed});
  EXPECT_EQ(replay.exit_code, 0) << replay.out;
  EXPECT_NE(replay.out.find("stimulation commands: bit-identical"), std::string::npos)
      << replay.out;
  EXPECT_TRUE(read_file(replayed) == read_file(live));

  const std::string exported = folder.path("exported.csv");
  const ProgramRun exporting = run_program({"export", session, "--sink", "stim-csv:" + exported});
  ASSERT_EQ(exporting.exit_code, 0) << exporting.err;
  EXPECT_TRUE(read_file(exported) == read_file(live));
}

/// The commands, without the times at which they left (sent_monotonic_ns, valid_until_ns).
std::string commands_of(const std::string& csv) {
  std::string text;
  for (const auto& row : rows_of(csv)) {
    for (std::size_t i = 0; i + 2 < row.size(); ++i) text += row[i] + ",";
    text += "\n";
  }
  return text;
}

/// Compares what left in wall time with what the encoder commanded. On a host that stops the
/// program, commands are withheld, refused or leave lower: none may be higher, or new.
/// \return whether all is equal
bool expect_commands_of(const std::string& commanded, const std::string& left) {
  if (commands_of(left) == commands_of(commanded)) return true;
  std::map<std::string, double> amplitudes;
  for (const auto& row : rows_of(commanded))
    amplitudes[row[0] + row[1] + row[2]] = std::atof(row[3].c_str());
  std::size_t live = 0;
  for (const auto& row : rows_of(left)) {
    const double amplitude_uA = std::atof(row[3].c_str());
    if (amplitude_uA == 0.0) continue;  // the header, and stops
    ++live;
    const auto same = amplitudes.find(row[0] + row[1] + row[2]);
    EXPECT_NE(same, amplitudes.end()) << row[0] << " " << row[1];
    if (same == amplitudes.end()) continue;
    EXPECT_LE(amplitude_uA, same->second) << row[0] << " " << row[1];
  }
  EXPECT_GT(live, 0U);
  return false;
}

TEST(Encoding, RealTimeAndPlayedSessionsGiveTheCommandsOfAFastRun) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kScene);
  const std::string probe = "sim:ramp?wait_s=0.05&hold_s=0.3";
  const std::string fast = folder.path("fast.csv");
  const std::string live = folder.path("live.csv");
  const std::string session = folder.path("session.xdf");
  ASSERT_EQ(run_program({"run", scene, "--fast", "--probe", probe, "--sink", "stim-csv:" + fast})
                .exit_code,
            0);
  const ProgramRun run = run_program({"run", scene, "--json", "--probe", probe, "--sink",
                                      "stim-csv:" + live, "--sink", "xdf:" + session});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  // What the encoder commanded, from the samples as they arrived.
  const std::string commanded = folder.path("commanded.csv");
  const ProgramRun again = run_program({"replay", session, "--sink", "stim-csv:" + commanded});
  EXPECT_TRUE(has(again.out, "stimulation commands: bit-identical")) << again.out;
  const bool in_time = json["samples_late"] == 0 && json["held_ticks"] == 0 &&
                       json["released_ticks"] == 0 && json["gaps"] == 0;
  if (in_time) {
    EXPECT_EQ(commands_of(read_file(commanded)), commands_of(read_file(fast)));
  }

  const bool equal = expect_commands_of(read_file(commanded), read_file(live));
  const bool withheld = json["commands_withheld"] > 0 || json["commands_slowed"] > 0;
  const bool reported = withheld || json["commands_refused"] > 0 || json["stale_stops"] > 0;
  EXPECT_TRUE(equal || reported) << run.out;
  EXPECT_FALSE(equal && withheld) << run.out;

  const std::string played = folder.path("played.csv");
  const ProgramRun replay =
      run_program({"replay", session, "--realtime", "--sink", "stim-csv:" + played});
  ASSERT_EQ(replay.exit_code, 0) << replay.err;
  expect_commands_of(read_file(commanded), read_file(played));
}

TEST(Encoding, PushedSamplesGiveTheCommandsOfAFastRun) {
  const TemporaryFolder folder;
  const std::string probe = "sim:taps?count=2&interval_s=0.2";
  const ProgramRun inspected =
      run_program({"inspect", "encoding", folder.file("scene.toml", kScene), "--probe", probe});
  ASSERT_EQ(inspected.exit_code, 0) << inspected.err;
  auto scene = parse_scene(kScene, "scene");
  ASSERT_TRUE(scene) << scene.error().sentence;
  const StimulationText rows(scene->encoding);
  auto stream = SampleStream::create(*scene, {ProbeSample::kDepth});
  ASSERT_TRUE(stream) << stream.error().sentence;
  auto source = *open_probe(probe);
  std::string text = StimulationText::csv_header() + "\n";
  const auto append_rows = [&] {
    for (const auto& command : stream->commands()) rows.append_row(text, {.command = command});
  };
  std::array<ProbeSample, 16> samples{};
  while (const auto count = source->read(samples, std::chrono::milliseconds{100})) {
    for (std::size_t i = 0; i < *count; ++i) {
      ASSERT_TRUE(stream->push(0, samples[i]));
      append_rows();
    }
  }
  static_cast<void>(stream->finish());
  append_rows();
  EXPECT_TRUE(text == inspected.out);
}

TEST(Encoding, EveryEncoderStimulatesWithinTheLimits) {
  const TemporaryFolder folder;
  const ProgramRun run = run_program({"inspect", "encoding", folder.file("scene.toml", kScene),
                                      "--probe", "replay:tests/traces/taps.csv"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto rows = rows_of(run.out);
  ASSERT_GT(rows.size(), 500U);
  for (const std::string name : {"rate", "recruited", "linear", "okorokova"}) {
    double strongest = 0.0;
    for (const auto& row : rows) {
      if (row[1] == name) strongest = std::max(strongest, std::stod(row[3]));
    }
    EXPECT_GT(strongest, 20.0) << name;
    EXPECT_LE(strongest, 80.0) << name;
  }
  const auto pulses =
      std::count_if(rows.begin(), rows.end(), [](const auto& row) { return row[2] == "pulse"; });
  EXPECT_GT(pulses, 20);
  // The run ends with everything off.
  for (auto row = rows.end() - 5; row != rows.end(); ++row) {
    EXPECT_EQ((*row)[3], "0");
    EXPECT_EQ((*row)[6], "end");
  }
}

TEST(Encoding, AChangedCommandIsFound) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kScene);
  const std::string session = folder.path("session.xdf");
  ASSERT_EQ(run_program({"run", scene, "--fast", "--probe", "replay:tests/traces/taps.csv",
                         "--sink", "xdf:" + session})
                .exit_code,
            0);
  // The scene that the session remembers gets another window.
  std::string bytes = read_file(session);
  const auto place = bytes.find("full_rate_Hz = 50");
  ASSERT_NE(place, std::string::npos);
  bytes.replace(place, 17, "full_rate_Hz = 51");
  std::ofstream(session, std::ios::binary) << bytes;
  const ProgramRun replay = run_program({"replay", session});
  EXPECT_EQ(replay.exit_code, 1);
  EXPECT_NE(replay.out.find("the replay has a command for rate"), std::string::npos) << replay.out;
}

TEST(Encoding, ASceneThatBreaksItsLimitsIsRefused) {
  const TemporaryFolder folder;
  std::string text = kScene;
  text.replace(text.find("max_charge_nC = 16"), 18, "max_charge_nC = 12");
  const ProgramRun run = run_program({"run", folder.file("scene.toml", text), "--fast"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("scene.toml:7: electrode[rate].amplitude_uA reaches 80 µA, which is 16 nC "
                         "in a phase of 200 µs, above stimulation.max_charge_nC = 12"),
            std::string::npos)
      << run.err;
}

TEST(Encoding, TheExampleOfTheDocumentsRuns) {
  const TemporaryFolder folder;
  const std::string text = read_file("core/encoding/README.md");
  const auto begin = text.find("```toml\n") + 8;
  const std::string scene =
      folder.file("scene.toml", text.substr(begin, text.find("```\n", begin) - begin));
  const ProgramRun run =
      run_program({"inspect", "encoding", scene, "--probe", "replay:tests/traces/taps.csv"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find(",E12,update,"), std::string::npos);
}

TEST(Encoding, AFullDiskStopsStimulation) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kScene);
  const std::string other = folder.path("other.csv");
  const ProgramRun run =
      run_program({"run", scene, "--fast", "--probe", "sim:ramp?hold_s=60", "--sink",
                   "stim-csv:/dev/full", "--sink", "stim-csv:" + other, "--json"});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  const auto rows = rows_of(read_file(other + (std::filesystem::exists(other) ? "" : ".part")));
  const auto stop = std::find_if(rows.begin(), rows.end(),
                                 [](const auto& row) { return row[6] == "sink_failure"; });
  ASSERT_NE(stop, rows.end());
  for (auto row = stop; row != rows.end(); ++row) EXPECT_EQ((*row)[3], "0");
}

}  // namespace
}  // namespace merkel
