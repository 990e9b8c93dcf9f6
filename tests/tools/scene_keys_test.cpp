#include "tools/scene/scene_keys.hpp"

#include <array>

#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

/// The rows of a spike file, without its comments.
std::string rows(const std::string& text) {
  std::istringstream lines(text);
  std::string result;
  std::string line;
  while (std::getline(lines, line)) {
    if (!line.starts_with('#')) result += line + "\n";
  }
  return result;
}

TEST(SceneKeys, EveryPresetIsItsPrintedScene) {
  for (const std::string& name : preset_names()) {
    const Scene preset = *preset_scene(name);
    const std::string text = scene_text(preset);
    const auto scene = parse_scene(text, "s.toml");
    ASSERT_TRUE(scene) << name << ": " << scene.error().sentence;
    EXPECT_EQ(scene->preset, name);
    // The text holds every key with its value, so equal texts mean equal parameters.
    EXPECT_EQ(scene_text(*scene), text) << name;
    EXPECT_EQ(scene->model.indenters.size(), preset.model.indenters.size());
    EXPECT_EQ(scene->model.patches.size(), preset.model.patches.size());
  }
}

TEST(SceneKeys, APatchOfThePresetKeepsItsValues) {
  const Scene hand = *preset_scene("hand");
  const auto scene = parse_scene(
      "preset = \"hand\"\n[[receptors]]\nname = \"palm\"\nwidth_mm = 88\n[[receptors]]\n"
      "name = \"wrist\"\n",
      "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  const PatchParameters& palm = scene->model.patches[0];
  const PatchParameters& whole = hand.model.patches.back();
  EXPECT_EQ(palm.patch.length_mm, whole.patch.length_mm);
  EXPECT_EQ(palm.patch.width_mm, 88.0);
  EXPECT_EQ(palm.patch.columns, whole.patch.columns);
  EXPECT_EQ(palm.receptors.count, whole.receptors.count);
  EXPECT_EQ(palm.receptors.seed, whole.receptors.seed);
  const PatchParameters& other = scene->model.patches[1];
  EXPECT_EQ(other.patch.length_mm, hand.model.patches.front().patch.length_mm);
  EXPECT_EQ(other.receptors.seed, hand.model.patches.front().receptors.seed + 1);
}

TEST(SceneKeys, EveryKeySurvivesBeingPrintedAndRead) {
  const auto scene = parse_scene(R"(
preset = "goodwin"
sink = [{ uri = "csv:a \"quoted\" \\ name" }]
[[receptors]]
name = "tip"
centres_mm = [[1.5, 2], [3, 4e-7]]
seed = 9007199254740993
[[receptors]]
name = "pad \u0001 \u00b5"
[[probe]]
patch = "pad \u0001 \u00b5"
tip = "bars"
bar_widths_mm = [1, 2.5]
bar_gaps_mm = [0.1]
delay_ms = 3.0625
control = "force"
[skin]
radius_mm = inf
dermis_kPa = 80.00000000000001
[loop]
cpu = 1
scheduler = "normal"
wait = "sleep"
tick_us = 250.5
lock_memory = false
max_catch_up_ticks = 0
[accuracy]
spike_time_us = 12.5
)",
                                 "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  const std::string text = scene_text(*scene);
  const auto again = parse_scene(text, "s.toml");
  ASSERT_TRUE(again) << again.error().sentence;
  EXPECT_EQ(scene_text(*again), text);
  EXPECT_EQ(again->model.skin.dermis_kPa, 80.00000000000001);
  EXPECT_EQ(again->model.patches[0].receptors.seed, 9007199254740993U);
  EXPECT_EQ(again->model.patches[0].centres[1].y_mm, 4e-7);
  EXPECT_EQ(again->model.patches[1].name, scene->model.patches[1].name);
  EXPECT_EQ(again->model.indenters[0].patch, 1U);
  EXPECT_EQ(again->probes[0].delay, std::chrono::nanoseconds{3'062'500});
  EXPECT_EQ(again->probes[0].control, Indenter::Control::kForce);
  EXPECT_EQ(again->loop.realtime.cpu, 1);
  EXPECT_FALSE(again->loop.realtime.fifo);
  EXPECT_EQ(again->loop.max_catch_up_ticks, 0);
  EXPECT_EQ(again->spike_time_us, 12.5);
  EXPECT_EQ(again->sinks, scene->sinks);
}

TEST(SceneKeys, APrintedPresetFiresTheGoldenSpikes) {
  for (const std::string& name : preset_names()) {
    const TemporaryFolder folder;
    const auto printed = run_program({"scene", name});
    ASSERT_EQ(printed.exit_code, 0) << printed.err;
    // The golden spikes of hand are those of its first probe.
    std::string text = printed.out;
    const std::string probe = "[[probe]]";
    if (const auto second = text.find(probe, text.find(probe) + 1); second != std::string::npos) {
      text.erase(second, text.find("\n[", text.rfind(probe)) - second);
    }
    const auto run = run_program({"run", folder.file("my.toml", text), "--fast", "--probe",
                                  "replay:tests/traces/taps.csv?use=depth", "--sink",
                                  "csv:" + folder.path("s.csv")});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(rows(read_file(folder.path("s.csv"))),
              rows(read_file("tests/golden/" + name + ".taps.csv")))
        << name;
  }
}

TEST(SceneKeys, TheDocumentIsUpToDate) {
  const auto keys = run_program({"scene", "--keys"});
  EXPECT_EQ(keys.exit_code, 0);
  EXPECT_EQ(keys.out, scene_keys_text());
  EXPECT_EQ(read_file("tools/scene/README.md"), keys.out)
      << "run: merkel scene --keys > tools/scene/README.md";
}

TEST(SceneKeys, AbsurdSizesAreRefusedWithASentence) {
  const auto fault = [](const std::string& text) {
    const auto scene = parse_scene(text, "s.toml");
    if (!scene) return scene.error().sentence;
    const auto model = TactileModel::create(scene->model);
    return model ? std::string("accepted") : scene->sentence(model.error());
  };
  EXPECT_EQ(fault("[receptors]\nlength_mm = 1e308\n"),
            "s.toml:2: receptors.length_mm must be at most 1000, but is 1e+308");
  EXPECT_EQ(fault("[probe]\ntip = \"pin\"\ndiameter_mm = 1000\n"),
            "s.toml:3: probe.diameter_mm must be at most 100, but is 1000");
  EXPECT_EQ(fault("[loop]\ntick_us = 1e300\n"),
            "s.toml:2: loop.tick_us must be at most 1000000 microseconds");
  EXPECT_EQ(fault("[probe]\ndelay_ms = -1\n"),
            "s.toml:2: probe.delay_ms must be zero or a positive number of milliseconds");
  EXPECT_EQ(fault("[probe]\ndelay_ms = 5\nmax_delay_ms = 3\n"),
            "s.toml:3: probe.max_delay_ms is smaller than delay_ms, which is never changed: remove "
            "one of the two");
  EXPECT_EQ(fault("[probe]\nx_mm = nan\n"),
            "s.toml:2: probe.x_mm must be a finite number, but is nan");
}

TEST(SceneKeys, APresetsProbesWithoutTheirPatchAreLeftOut) {
  const auto scene = parse_scene("preset = \"hand\"\n[receptors]\ncolumns = 3\n", "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->model.patches.size(), 1U);
  EXPECT_EQ(scene->probes.size(), 1U);
  EXPECT_TRUE(TactileModel::create(scene->model));
}

}  // namespace
}  // namespace merkel
