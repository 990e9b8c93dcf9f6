// Groups of electrodes, stimulators and encoders through scenes and the program.
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_encoder.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/studies/encoders/encoder_comparison.hpp"

namespace merkel {
namespace {

constexpr auto kGroupScene = R"(preset = "goodwin"
[[electrode_group]]
name = "tip"
encoder = "linear"
full_force_N = 0.5
border_mm = 1.5
frequency_Hz = [50, 200]
max_charge_nC_per_s = 5000
[[electrode]]
name = "E1"
group = "tip"
field_mm = [14, 10, 2]
amplitude_uA = [20, 60]
[[electrode]]
name = "E2"
group = "tip"
group_weight = 0.5
field_mm = [16, 10, 2]
amplitude_uA = [20, 80]
[[electrode]]
name = "E3"
field_mm = [15, 10, 3]
amplitude_uA = [20, 80]
frequency_Hz = [0, 100]
[stimulation]
phase_us = 200
interphase_us = 53
max_charge_nC = 16
max_total_uA = 250
watchdog_ms = 100
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string refusal(const std::string& text) {
  const auto scene = parse_scene(text, "scene.toml");
  return scene ? "" : scene.error().sentence;
}

TEST(ElectrodeScenes, GroupsSetTheEncoderAndTheFrequencyOfTheirElectrodes) {
  const auto scene = parse_scene(kGroupScene, "scene.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  const auto& electrodes = scene->encoding.electrodes;
  ASSERT_EQ(electrodes.size(), 3U);
  EXPECT_EQ(electrodes[1].group, 0U);
  EXPECT_EQ(electrodes[1].encoder, EncoderKind::kLinear);
  EXPECT_EQ(electrodes[1].frequency_Hz, (std::vector{50.0, 200.0}));
  EXPECT_EQ(electrodes[1].field_mm, (std::vector{16.0, 10.0, 2.0}));
  EXPECT_EQ(electrodes[1].group_weight, 0.5);
  EXPECT_FALSE(electrodes[2].group);
  EXPECT_EQ(electrodes[2].encoder, EncoderKind::kRate);
  // The text of the scene gives the same scene, and so does its text.
  const std::string text = scene_text(*scene);
  const auto again = parse_scene(text, "scene.toml");
  ASSERT_TRUE(again) << again.error().sentence;
  EXPECT_EQ(scene_text(*again), text);
  EXPECT_EQ(again->encoding.electrodes[1].frequency_Hz, electrodes[1].frequency_Hz);
  EXPECT_EQ(again->encoding.groups[0].max_charge_nC_per_s, 5000.0);
}

TEST(ElectrodeScenes, WhatBelongsToTheGroupIsRefusedAtAnElectrode) {
  EXPECT_EQ(refusal(replaced(kGroupScene, "field_mm = [14, 10, 2]", "encoder = \"rate\"")),
            "scene.toml:12: electrode[E1].encoder is that of the group tip: set it there, or "
            "remove it");
  EXPECT_TRUE(has(refusal(replaced(kGroupScene, "border_mm = 1.5", "field_mm = [15, 10, 2]")),
                  "electrode[E1].field_mm is that of the group tip"));
  EXPECT_TRUE(has(refusal(replaced(kGroupScene, "group = \"tip\"", "group = \"top\"")),
                  "did you mean \"tip\"?"));
  EXPECT_EQ(refusal(replaced(kGroupScene, "frequency_Hz = [50, 200]", "frequency_Hz = [50, 600]")),
            "");
  EXPECT_EQ(refusal("[[electrode]]\ngroup = \"tip\"\n"),
            "scene.toml:2: electrode[E1].group names a group, but the scene has none: add "
            "[[electrode_group]] with a name");
}

TEST(ElectrodeScenes, TheAdviceOnTheWatchdogWorksForAnyTick) {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& watchdog_ms) {
    const std::string text =
        replaced(kGroupScene, "watchdog_ms = 100", "update_ms = 60\nwatchdog_ms = " + watchdog_ms) +
        "[loop]\ntick_us = 60000\n";
    return run_program({"run", folder.file("s.toml", replaced(text, "= [50, 200]", "= [5, 5]")),
                        "--fast", "--duration-s", "0.2"});
  };
  EXPECT_TRUE(has(run("100").err,
                  "watchdog_ms must be at least two ticks of 60 ms: 120 ms, or shorten "
                  "loop.tick_us"));
  const auto advised = run("120");
  EXPECT_EQ(advised.exit_code, 0) << advised.err;
}

TEST(ElectrodeScenes, WithoutElectrodesItsLimitsAreRefused) {
  const TemporaryFolder folder;
  const std::string scene = folder.file(
      "s.toml", "preset = \"goodwin\"\n[stimulation]\nupdate_ms = 10\nwatchdog_ms = 100\n");
  for (const char* command : {"run", "plan", "scene"}) {
    EXPECT_TRUE(has(run_program({command, scene}).err,
                    "s.toml:2: stimulation has no effect, because the scene has no "
                    "electrodes: add [[electrode]], or remove the table\n"))
        << command;
  }
}

TEST(ElectrodeScenes, AProfileBecomesTheStimulatorOfTheScene) {
  const std::string with =
      replaced(kGroupScene, "phase_us = 200", "phase_us = 200\nprofile = \"cerestim\"");
  const auto scene = parse_scene(with, "scene.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->encoding.stimulator.name, "cerestim");
  EXPECT_EQ(scene->encoding.stimulator.max_amplitude_uA, 215.0);
  EXPECT_EQ(scene->encoding.stimulator.waveforms, 15);
  const auto again = parse_scene(scene_text(*scene), "scene.toml");
  ASSERT_TRUE(again) << again.error().sentence;
  EXPECT_EQ(again->encoding.stimulator.time_step, std::chrono::microseconds{1});
  EXPECT_EQ(scene_text(*again), scene_text(*scene));
  EXPECT_EQ(refusal(replaced(with, "interphase_us = 53", "interphase_us = 50")),
            "scene.toml:28: stimulation.interphase_us must be one that the stimulator cerestim "
            "has: 53 to 65535 µs in steps of 1");
  EXPECT_TRUE(has(refusal(replaced(with, "\"cerestim\"", "\"celestim\"")),
                  "is neither a stimulator that merkel knows (cerestim, grapevine) nor a file"));
}

TEST(ElectrodeScenes, AProfileOfAUserIsAFileBesideTheScene) {
  const TemporaryFolder folder;
  static_cast<void>(folder.file("own.toml", "amplitude_step_uA = 5\nmax_amplitude_uA = 100\n"));
  const std::string path = folder.file(
      "scene.toml",
      replaced(kGroupScene, "phase_us = 200", "phase_us = 200\nprofile = \"own.toml\""));
  const auto scene = read_scene(path);
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->encoding.stimulator.name, "own.toml");
  EXPECT_EQ(scene->encoding.stimulator.amplitude_step_uA, 5.0);
  static_cast<void>(folder.file("own.toml", "amplitude_steps_uA = 5\n"));
  const auto wrong = read_scene(path);
  ASSERT_FALSE(wrong);
  EXPECT_TRUE(has(wrong.error().sentence, "own.toml:1: "));
  EXPECT_TRUE(has(wrong.error().sentence, "amplitude_step_uA"));
}

TEST(ElectrodeScenes, GroupsRunAndReplayBitForBit) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kGroupScene);
  const std::string session = folder.path("session.xdf");
  const ProgramRun run =
      run_program({"run", scene, "--fast", "--probe", "replay:tests/traces/ramp_and_hold.csv",
                   "--sink", "xdf:" + session});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const ProgramRun replay = run_program({"replay", session});
  EXPECT_EQ(replay.exit_code, 0) << replay.out;
  EXPECT_TRUE(has(replay.out, "stimulation commands: bit-identical")) << replay.out;
}

TEST(CompareEncoders, TellsTheRulesOfOneTouchApart) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kGroupScene);
  const ProgramRun run =
      run_program({"compare-encoders", "tests/traces/ramp_and_hold.csv", scene, "--encoder",
                   "linear", "--encoder", "biomimetic", "--encoder", "rate", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  ASSERT_EQ(json.size(), 3U);
  EXPECT_EQ(json[0]["encoder"], "linear");
  // The force rises with the press: less charge in the first 100 ms than later.
  EXPECT_LT(json[0]["onset_ratio"], 1.0);
  EXPECT_GT(json[1]["onset_ratio"], 1.0);
  // The afferents adapt, so their rate falls while the force stays.
  EXPECT_GT(json[2]["onset_ratio"], json[0]["onset_ratio"]);
  EXPECT_GT(json[2]["rate_correlation"], json[1]["rate_correlation"]);
  EXPECT_LT(json[1]["charge_uC"], json[0]["charge_uC"]);
  for (const auto& each : json) {
    EXPECT_GT(each["charge_uC"], 0.0);
    EXPECT_LE(each["peak_uA"], 80.0);
    EXPECT_LE(each["peak_total_uA"], 250.0);
    EXPECT_GE(each["peak_total_uA"], each["peak_uA"]);
  }
}

TEST(CompareEncoders, TheChargeIsThatOfTheCommands) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", R"(preset = "goodwin"
[[electrode]]
field_mm = [15, 10, 4]
amplitude_uA = [50, 50]
frequency_Hz = [100, 100]
full_force_N = 0.001
[stimulation]
max_charge_nC = 10
max_total_uA = 50
watchdog_ms = 100
)");
  // Without a window, linear is on as long as the press: 2 s and its ramps.
  const ProgramRun run = run_program({"compare-encoders", "tests/traces/ramp_and_hold.csv", scene,
                                      "--encoder", "linear", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  const double on_s = json[0]["charge_uC"].get<double>() / (50e-6 * 200e-6 * 100.0 * 1e6);
  EXPECT_GT(on_s, 2.0);
  EXPECT_LT(on_s, 2.5);
  EXPECT_NEAR(on_s, std::round(on_s * 100.0) / 100.0, 1e-6);  // whole updates of 10 ms
  EXPECT_NEAR(json[0]["onset_ratio"], 1.0, 0.11);             // on from the first update on
  EXPECT_EQ(json[0]["peak_total_uA"], 50.0);
}

TEST(CompareEncoders, PulsesAndTrainsChargeTheBinsOfTheirTimes) {
  using std::chrono::microseconds;
  constexpr auto kPulse = StimulationCommand::Kind::kPulse;
  EncodedTouch touch{.electrodes = std::vector<Electrode>(2),
                     .phases = std::vector<std::chrono::nanoseconds>(2, microseconds{200})};
  for (int ms = 1; ms <= 10; ++ms) touch.ticks.push_back({.time = microseconds{1000 * ms}});
  // 10 nC, and 6 nC twice; 800 nC/s for 5 ms. The last pulse is after the last tick.
  touch.commands = {
      {.time = microseconds{2500}, .amplitude_uA = 50.0, .electrode = 0, .kind = kPulse},
      {.time = microseconds{4000}, .amplitude_uA = 40.0, .frequency_Hz = 100.0, .electrode = 1},
      {.time = microseconds{7000}, .amplitude_uA = 30.0, .electrode = 0, .kind = kPulse},
      {.time = microseconds{9000}, .amplitude_uA = 0.0, .frequency_Hz = 100.0, .electrode = 1},
      {.time = microseconds{11000}, .amplitude_uA = 30.0, .electrode = 0, .kind = kPulse}};
  const auto charge_rate_uA = charge_rate(touch, microseconds{5000});
  ASSERT_EQ(charge_rate_uA.size(), 2U);
  EXPECT_NEAR(charge_rate_uA[0], (10.0 + 0.8) / 5.0, 1e-12);
  EXPECT_NEAR(charge_rate_uA[1], (6.0 + 3.2 + 6.0) / 5.0, 1e-12);
}

TEST(CompareEncoders, RefusesWithAdvice) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kGroupScene);
  const auto error = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"compare-encoders", "tests/traces/taps.csv", scene});
    const ProgramRun run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 2);
    return run.err;
  };
  EXPECT_TRUE(has(error({"--encoder", "linear", "--encoder", "lineal"}),
                  "--encoder lineal: there is no such encoder; use one of rate, recruited"));
  EXPECT_TRUE(has(error({"--encoder", "pulse_per_spike"}),
                  "electrode_group[tip].encoder must not be pulse_per_spike"));
  EXPECT_TRUE(has(error({}), "name the encoders to compare"));
}

}  // namespace
}  // namespace merkel
