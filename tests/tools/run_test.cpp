#include <algorithm>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_overrides.hpp"
#include "tools/scene/scene_presets.hpp"

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

TEST(Run, RepeatPlaysThePressesUntilTheDurationEnds) {
  const TemporaryFolder folder;
  const auto run = run_program({"run", "hand", "--fast", "--repeat", "--duration-s", "9", "--json",
                                "--sink", "xdf:" + folder.path("s.xdf")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto once = run_program({"run", "hand", "--fast", "--json"});
  const auto spikes = nlohmann::json::parse(run.out)["spikes"].get<double>();
  EXPECT_GT(spikes, 3.0 * nlohmann::json::parse(once.out)["spikes"].get<double>());
  EXPECT_EQ(run_program({"replay", folder.path("s.xdf")}).exit_code, 0);
  const auto endless = run_program({"run", "hand", "--fast", "--repeat"});
  EXPECT_EQ(endless.exit_code, 2);
  EXPECT_NE(endless.err.find("add --duration-s"), std::string::npos) << endless.err;
  const auto device = run_program({"run", "--repeat", "--probe", "serial:/dev/null?protocol=csv"});
  EXPECT_NE(device.err.find("no probe of the scene is a recording"), std::string::npos);
}

TEST(Run, SetGivesTheSpikesOfASceneFileWithTheKey) {
  const TemporaryFolder folder;
  const auto spikes = [&](std::vector<std::string> arguments) {
    const std::string file = folder.path("set.csv");
    for (const char* more : {"--fast", "--overwrite", "--sink"}) arguments.emplace_back(more);
    arguments.push_back("csv:" + file);
    const auto run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return read_file(file);
  };
  const std::string scene = folder.file(
      "s.toml", "preset = \"goodwin\"\n[skin]\nradius_mm = 8\n[[probe]]\nx_mm = 14.5\n");
  const std::string set =
      spikes({"run", "goodwin", "--set", "skin.radius_mm=8", "--set", "probe.x_mm=14.5"});
  EXPECT_GT(set.size(), 1000U);
  EXPECT_EQ(set, spikes({"run", scene}));
  EXPECT_NE(set, spikes({"run", "goodwin"}));

  const auto refused = [&](const std::string& text) {
    const auto run = run_program({"run", "goodwin", "--fast", "--set", text});
    EXPECT_EQ(run.exit_code, 2);
    return run.err;
  };
  EXPECT_NE(refused("skin.radius=8").find("did you mean skin.radius_mm?"), std::string::npos);
  EXPECT_NE(refused("skin.radius_mm").find("is not KEY=VALUE"), std::string::npos);
  EXPECT_NE(refused("skin.radius_mm=wide").find("skin.radius_mm must be"), std::string::npos);
}

TEST(Run, ExamplesAndTheirTracesAreFoundByName) {
  const auto list = run_program({"scene", "--list"});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  for (const char* line :
       {"  goodwin: 450 afferents", "  letter: An embossed letter A, 6 mm high"}) {
    EXPECT_NE(list.out.find(line), std::string::npos) << list.out;
  }
  const auto by_name = run_program({"scene", "edge_orientation"});
  EXPECT_EQ(by_name.exit_code, 0) << by_name.err;
  EXPECT_EQ(by_name.out, run_program({"scene", "tools/examples/edge_orientation.toml"}).out);
  EXPECT_EQ(spikes_of("replay:taps"), spikes_of("replay:" + kTraces + "taps.csv"));

  const auto mistyped = run_program({"run", "leter", "--fast"});
  EXPECT_EQ(mistyped.exit_code, 2);
  EXPECT_NE(mistyped.err.find("did you mean letter?"), std::string::npos) << mistyped.err;
  const auto unknown = run_program({"run", "zzzzzzzz", "--fast"});
  EXPECT_NE(unknown.err.find("merkel scene --list"), std::string::npos) << unknown.err;
}

TEST(Run, RecipesChangeOnePropertyOfTheirPreset) {
  const auto scene = [](const char* name) { return *scene_named(name); };
  const SkinParameters older = scene("older_finger").model.skin;
  EXPECT_NEAR(older.dermis_kPa / scene("finger").model.skin.dermis_kPa, 2.0, 0.01);
  EXPECT_NEAR(older.epidermis_kPa, older.dermis_kPa, 1e-9);

  const Scene goodwin = scene("goodwin");
  const auto afferents = [](const Scene& of) { return TactileModel::create(of.model)->neurons(); };
  EXPECT_EQ(afferents(scene("denser_finger")), 2 * afferents(goodwin));
  // The same by the densities, as its text says; one of them alone is refused with the way out.
  const SceneOverrides densities = {{"receptors.density_per_mm2", "1.5"},
                                    {"receptors.density_max_per_mm2", "2.58"},
                                    {"receptors.density_min_per_mm2", "0.286"}};
  EXPECT_EQ(afferents(*with_overrides(goodwin, densities)), 2 * afferents(goodwin));
  const auto alone =
      run_program({"run", "goodwin", "--fast", "--set", "receptors.density_per_mm2=1.5"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.err.find("receptors.count"), std::string::npos) << alone.err;

  const Scene hand = scene("hand");
  const Scene bigger = scene("bigger_hand");
  ASSERT_EQ(bigger.model.patches.size(), hand.model.patches.size());
  EXPECT_EQ(afferents(bigger), afferents(hand));
  for (std::size_t i = 0; i < hand.model.patches.size(); ++i) {
    const Patch& patch = bigger.model.patches[i].patch;
    EXPECT_NEAR(patch.length_mm, 1.09 * hand.model.patches[i].patch.length_mm, 1e-9);
    EXPECT_NEAR(patch.width_mm, 1.09 * hand.model.patches[i].patch.width_mm, 1e-9);
    EXPECT_EQ(bigger.model.patches[i].receptors.count, hand.model.patches[i].receptors.count);
    EXPECT_EQ(bigger.model.patches[i].receptors.seed, hand.model.patches[i].receptors.seed);
    EXPECT_NEAR(bigger.probes[i].input.x_mm, 0.5 * patch.length_mm, 1e-9);
  }
}

TEST(Run, APressBeyondTheSolvedDepthsIsNamed) {
  const auto law_of = [](const std::string& depth_mm) {
    return run_program({"run", "goodwin", "--fast", "--set", "skin.contact_law=sneddon", "--probe",
                        "sim:ramp?hold_s=0.02&depth_mm=" + depth_mm})
        .out;
  };
  const std::string within = law_of("3.9");
  EXPECT_TRUE(has(within, "at depths to 4 mm"));
  EXPECT_FALSE(has(within, "this press is deeper"));
  EXPECT_TRUE(has(law_of("4.1"), "this press is deeper"));
}

TEST(Run, ATextMayBeSetWithItsQuotes) {
  const auto model = [](const std::string& law) {
    const auto scene = with_overrides(*scene_named("goodwin"), {{"skin.contact_law", law}});
    return scene ? scene_text(*scene) : scene.error().sentence;
  };
  EXPECT_NE(model("sneddon"), model("hertz"));
  EXPECT_EQ(model("\"sneddon\""), model("sneddon"));
  EXPECT_EQ(model("'sneddon'"), model("sneddon"));
  const auto sink =
      with_overrides(*scene_named("goodwin"), {{"probe.uri", "\"sim:grasp#palm_mm\""}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  EXPECT_EQ(sink->probes[0].uri, "sim:grasp#palm_mm");
}

TEST(Run, TheLargestSeedIsThatOfASceneFile) {
  Scene hand = *scene_named("hand");
  hand.set_seed(INT64_MAX);
  EXPECT_TRUE(parse_scene(scene_text(hand), "scene"));
  const std::string probe = "replay:" + kTraces + "taps.csv";
  EXPECT_EQ(spikes_of(probe, {"--seed", "010"}), spikes_of(probe, {"--seed", "10"}));
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
  EXPECT_EQ(spikes_of("sim:ramp"), spikes_of("replay:" + kTraces + "ramp_and_hold.csv?use=depth"));
}

TEST(Run, SeedsChangeTheReceptors) {
  const std::string probe = "replay:" + kTraces + "ramp_and_hold.csv";
  const std::string one = spikes_of(probe, {"--seed", "1"});
  EXPECT_EQ(spikes_of(probe, {"--seed", "010"}), spikes_of(probe, {"--seed", "10"}));
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

TEST(Run, TheExampleOfAHandStimulatesThroughItsSixteenElectrodes) {
  const TemporaryFolder folder;
  const auto run =
      run_program({"run", "tools/examples/hand_electrodes.toml", "--fast", "--duration-s", "1.4",
                   "--sink", "stim-csv:" + folder.path("stim.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  const std::string commands = read_file(folder.path("stim.csv"));
  std::set<std::string> active;
  std::istringstream lines(commands);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream row(line);
    std::string field[4];
    for (std::string& each : field) std::getline(row, each, ',');
    if (field[2] == "update" && std::stod(field[3]) > 0.0) active.insert(field[1]);
  }
  EXPECT_EQ(active.size(), 16U) << commands.substr(0, 400);
}

TEST(Run, ATraceInGramsAndMicrometresIsRead) {
  const TemporaryFolder folder;
  std::string rows = "time_ms,force_g,depth_um\n";
  for (int k = 0; k < 300; ++k) rows += std::to_string(k) + ",60,1500\n";
  const auto run =
      run_program({"run", "--fast", "--json", "--probe", "replay:" + folder.file("t.csv", rows)});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto press = nlohmann::json::parse(run.out)["probes"][0];
  EXPECT_NEAR(press["deepest_press"]["force_N"], 0.588399, 1e-6);
  EXPECT_NEAR(press["force_and_depth"]["depth_mm"], 1.5, 1e-12);
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

TEST(Run, DistancesAreFromTheFirstProbeThatTouched) {
  const TemporaryFolder folder;
  const std::string none =
      "replay:" + folder.file("none.csv", "time_s,depth_mm\n0,0\n0.5,0\n1,0\n");
  const auto distances = [&](const std::string& second) {
    const std::string scene =
        folder.file("s.toml", "preset = \"goodwin\"\n[[probe]]\nuri = \"" + none +
                                  "\"\nx_mm = 20\ny_mm = 10\n[[probe]]\nuri = \"" + second +
                                  "\"\nx_mm = 15\ny_mm = 10\n");
    const ProgramRun run = run_program({"run", scene, "--fast", "--json", "--duration-s", "0.5"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const auto summary = nlohmann::json::parse(run.out);
    std::vector<nlohmann::json> all;
    for (const auto& neuron : summary["neurons"]) {
      all.push_back(neuron["mean_distance_mm"]);
    }
    return all;
  };
  const ProgramRun alone = run_program({"run", "goodwin", "--fast", "--json", "--duration-s", "0.5",
                                        "--set", "probe.x_mm=15", "--set", "probe.y_mm=10"});
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  const auto expected = nlohmann::json::parse(alone.out)["neurons"];
  const auto second = distances("sim:ramp");
  const auto neither = distances(none);
  ASSERT_EQ(second.size(), expected.size());
  ASSERT_EQ(neither.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(second[i], expected[i]["mean_distance_mm"]) << i;
    EXPECT_TRUE(neither[i].is_null()) << i;
  }
}

TEST(Run, TheSummaryBeginsWithTheTouchAndTheSpikesAndEndsWithCounters) {
  const std::string hand = run_program({"run", "hand", "--fast", "--duration-s", "0.6"}).out;
  std::size_t last = 0;
  for (const char* const part : {"thumb: deepest press", "palm: deepest press", "afferents: ",
                                 "verdict: ", "probe sim:ramp: ", "counters (ticks of 1 ms):"}) {
    const std::size_t at = hand.find(part);
    ASSERT_NE(at, std::string::npos) << part << hand;
    EXPECT_GT(at, last) << part;
    last = at;
  }
}

TEST(Run, TheSummarySaysWhatDroveItAndWhetherItIsAPressOfTheFit) {
  const auto driven = [](const std::string& scene, const std::string& press,
                         const std::string& set = "skin.poisson_ratio=0.48") {
    return run_program(
               {"run", scene, "--fast", "--probe", "sim:ramp?hold_s=0.1&" + press, "--set", set})
        .out;
  };
  const std::string fitted =
      " the 0.098 to 0.196 N of the spheres to which the afferents are fitted";
  const std::string extrapolated = ": their rates are an extrapolation\n";
  EXPECT_TRUE(has(driven("goodwin", "force_N=0.15"),
                  "validity:\n  driven by its force, simulated\n  fit: within" + fitted + "\n"));
  EXPECT_TRUE(has(driven("finger", "force_N=0.79"), "beyond" + fitted + extrapolated));
  EXPECT_TRUE(has(driven("goodwin", "depth_mm=2"),
                  "driven by its depth, simulated\n  fit: beyond" + fitted + extrapolated));
  EXPECT_TRUE(has(driven("goodwin", "force_N=0.15", "skin.thickness_mm=4"),
                  fitted + ", but on a skin that this scene changes" + extrapolated));
  EXPECT_TRUE(
      has(driven("goodwin", "force_N=0.15", "probe.tip=pin"), ", but this tip is no sphere"));
  EXPECT_TRUE(has(driven("paper", "depth_mm=1"), "fitted to no press of this kind\n"));
}

TEST(Run, WhatTheRatesRestOnIsSaidOnceForAllProbes) {
  const std::vector<std::string> run = {"run", "hand", "--fast", "--duration-s", "0.5"};
  for (const auto& words : {run, std::vector<std::string>{"plan", "hand"}}) {
    const std::string text = run_program(words).out;
    EXPECT_TRUE(has(text, "validity:\n  driven by its depth, simulated\n")) << text;
    EXPECT_EQ(text.find("skin law: "), text.rfind("skin law: ")) << text;
  }
  // A plan of the hand takes seconds.
  for (auto words : {run, std::vector<std::string>{"plan", "paper"}}) {
    words.emplace_back("--json");
    const auto validity = nlohmann::json::parse(run_program(words).out)["validity"];
    ASSERT_EQ(validity.size(), 1U) << validity;
    EXPECT_EQ(validity[0]["driven_by"], "depth");
    EXPECT_TRUE(validity[0]["fit"].is_null());
    EXPECT_EQ(validity[0]["probes"].size(), words[1] == "hand" ? 6U : 1U);
  }
  const auto several =
      run_program({"run", "hand", "--fast", "--duration-s", "0.5", "--set", "probe[5].radius_mm=8"})
          .out;
  EXPECT_TRUE(has(several, "validity of thumb, index, middle, ring, little:\n")) << several;
  EXPECT_TRUE(has(several, "validity of palm:\n")) << several;
}

TEST(Run, TheRemediesOfTheSkinsLawWork) {
  const auto law = [](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"run", "goodwin", "--fast", "--duration-s", "0.5"};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words).out;
  };
  const std::string hertz = law({});
  for (const char* const remedy : {"contact_law = \"sneddon\"", "thickness_mm = 4"}) {
    EXPECT_TRUE(has(hertz, remedy)) << hertz;
  }
  for (const char* const key : {"skin.contact_law=sneddon", "skin.thickness_mm=4"}) {
    const std::string solved = law({"--set", key});
    EXPECT_TRUE(has(solved, "contact of the tip \"sphere\" solved")) << solved;
    EXPECT_FALSE(has(solved, "Hertz")) << solved;
  }
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
      {{"--sink", "csv:" + folder.path("no/folder/s.csv")}, "create its folder first"},
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

/// The spikes that a run's JSON summary counts.
int spikes_in(const std::vector<std::string>& arguments) {
  std::vector<std::string> all = {"run", "--fast", "--json"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const auto run = run_program(all);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return nlohmann::json::parse(run.out)["spikes"].get<int>();
}

TEST(Run, APressThatNoAfferentFeelsIsExplainedAndTheAdviceWorks) {
  struct Silent {
    std::string press;    ///< without the level
    std::string level;    ///< too weak for any afferent
    std::string reached;  ///< part of what is printed
    std::regex advice;
  };
  const std::vector<Silent> presses = {
      {"sim:ramp?ramp_s=0.5&depth_mm=", "1", "the press reached 0.247 N (1 mm)",
       std::regex("Press deeper than about ([0-9.]+) mm")},
      {"sim:ramp?ramp_s=1&force_N=", "0.2", "the press reached 0.2 N",
       std::regex("Press harder than about ([0-9.]+) N")},
      // Fast presses fire at less, and the advice is for presses as fast as the one that was seen.
      {"sim:ramp?depth_mm=", "0.6", "the press reached 0.115 N (0.6 mm)",
       std::regex("Press deeper than about (0[.][0-9]+) mm, with the same rise time .20 ms.")},
      {"sim:ramp?force_N=", "0.1", "the press reached 0.1 N",
       std::regex("Press harder than about ([0-9.]+) N, with the same rise time .20 ms.")},
      {"sim:taps?depth_mm=", "0.6", "the press reached 0.115 N (0.6 mm)",
       std::regex("Press deeper than about ([0-9.]+) mm, with the same rise time .47 ms.")}};
  for (const Silent& silent : presses) {
    const std::string uri = silent.press + silent.level;
    EXPECT_EQ(spikes_in({"--probe", uri}), 0);
    const std::string out = run_program({"run", "--fast", "--probe", uri}).out;
    EXPECT_NE(out.find("no afferent fired: " + silent.reached), std::string::npos) << out;
    EXPECT_TRUE(std::regex_search(out, std::regex("reached [0-9.]+ % of its rheobase"))) << out;
    std::smatch advice;
    ASSERT_TRUE(std::regex_search(out, advice, silent.advice)) << out;
    EXPECT_GT(spikes_in({"--probe", silent.press + advice[1].str()}), 0) << advice[1];
    // Below the advice by more than its rounding, no afferent fires.
    EXPECT_EQ(spikes_in({"--probe", silent.press + std::to_string(0.85 * std::stod(advice[1]))}), 0)
        << advice[1];
    EXPECT_NE(out.find("try merkel run goodwin --probe '" + uri + "'"), std::string::npos) << out;
    EXPECT_GT(spikes_in({"goodwin", "--probe", uri}), 0);
  }
  const auto json = run_program({"run", "--fast", "--json", "--probe", "sim:ramp?depth_mm=0.6"});
  EXPECT_NE(json.out.find("\"silence\": \"no afferent fired: the press reached"), std::string::npos)
      << json.out;
  const auto apart = run_program({"run", "--fast", "--probe", "sim:ramp?depth_mm=0"});
  EXPECT_NE(apart.out.find("no afferent fired: no probe touched the skin"), std::string::npos);
  EXPECT_EQ(run_program({"run", "--fast"}).out.find("no afferent fired"), std::string::npos);
}

TEST(Run, ListsTheTenMostActiveAfferentsByTheirRateDuringContact) {
  const auto rows_of = [](const std::string& out) {
    std::vector<double> rates;
    std::istringstream lines(out.substr(out.find("whole_run_hz\n") + 13));
    std::string line;
    while (std::getline(lines, line)) {
      std::istringstream fields(line);
      double number = 0.0;
      double receptors = 0.0;
      double distance = 0.0;
      double spikes = 0.0;
      double contact_hz = 0.0;
      if (!(fields >> number >> receptors >> distance >> spikes >> contact_hz)) break;
      rates.push_back(contact_hz);
    }
    return rates;
  };
  const auto ten = rows_of(run_program({"run", "goodwin", "--fast"}).out);
  EXPECT_EQ(ten.size(), 10U);
  EXPECT_TRUE(std::is_sorted(ten.rbegin(), ten.rend()));
  EXPECT_GT(ten.back(), 10.0);
  const auto all = rows_of(run_program({"run", "goodwin", "--fast", "--all"}).out);
  EXPECT_EQ(all.size(), 450U);
  EXPECT_EQ(std::vector<double>(all.begin(), all.begin() + 10), ten);
}

TEST(Run, RatesDuringContactAreOfTheTimeOfContact) {
  const auto run = run_program({"run", "--fast", "--json"});
  const auto summary = nlohmann::json::parse(run.out);
  // The built-in press touches from 0.2 s to 2.24 s, of 2.74 s.
  const auto& eighth = summary["neurons"][7];
  EXPECT_NEAR(eighth["contact_rate_hz"].get<double>(), eighth["spikes"].get<int>() / 2.04, 0.2);
  EXPECT_NEAR(eighth["rate_hz"].get<double>(), eighth["spikes"].get<int>() / 2.74, 0.2);
  const auto apart = run_program({"run", "--fast", "--json", "--probe", "sim:ramp?depth_mm=0"});
  EXPECT_TRUE(nlohmann::json::parse(apart.out)["neurons"][0]["contact_rate_hz"].is_null());
}

TEST(Run, MissingQuantitiesAreNull) {
  const TemporaryFolder folder;
  const auto press_of = [&](const std::string& scene) {
    const auto run = run_program({"run", folder.file("s.toml", scene), "--fast", "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return nlohmann::json::parse(run.out)["probes"][0]["deepest_press"];
  };
  for (const char* const tip : {"pin", "bars"}) {
    const auto press = press_of("[probe]\ntip = \"" + std::string(tip) + "\"\n");
    for (const char* const key :
         {"contact_radius_mm", "peak_pressure_kPa", "radius_ratio", "sphere_force_error",
          "layer_ratio", "layer_force_error", "valid"}) {
      EXPECT_TRUE(press.at(key).is_null()) << tip << " " << key;
    }
    EXPECT_GT(press["force_N"].get<double>(), 0.0);
  }
  const auto sphere = press_of("");
  EXPECT_NEAR(sphere["contact_radius_mm"].get<double>(), 1.732, 1e-3);
  EXPECT_NEAR(sphere["layer_ratio"].get<double>(), 0.433, 1e-3);
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

TEST(Run, ADurationBelowATickIsRefused) {
  const auto none = run_program({"run", "--fast", "--duration-s", "0.0009"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("s is shorter than a tick of 0.001 s"), std::string::npos) << none.err;
  EXPECT_EQ(run_program({"run", "--fast", "--duration-s", "0.001"}).exit_code, 0);
}

}  // namespace
}  // namespace merkel
