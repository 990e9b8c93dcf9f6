// Every scene runs or is refused with an error: all keys of all presets with unusual values.
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene/tactile_model.hpp"
#include "tests/fuzz/scene_run.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {
namespace {

/// Runs a scene and expects spikes in order, or an error.
void run(const std::string& text, int ticks) {
  SCOPED_TRACE(text);
  EXPECT_EQ(fault_of_run(text, ticks), "");
}

class EveryScene : public testing::TestWithParam<const char*> {};

TEST_P(EveryScene, RunsOrIsRefused) {
  const std::string preset = std::string("preset = \"") + GetParam() + "\"\n";
  const std::vector<std::string> keys = number_keys();
  ASSERT_GT(keys.size(), 50U);
  std::size_t number = 0;
  for (const std::string& key : keys) {
    for (const char* const value : kUnusualValues) {
      if (number++ % 23 != 0 && std::getenv("MERKEL_EVERY_SCENE") == nullptr) continue;
      // Long ticks have many steps.
      const int ticks = key.starts_with("loop.") ? 2 : 20;
      run(preset + key + " = " + value + "\n", ticks);
    }
  }
}

// The hand has the paper's keys, but 212 times the afferents.
INSTANTIATE_TEST_SUITE_P(OfPresets, EveryScene, testing::Values("paper", "goodwin"));

TEST(Scenes, NeuronsWithoutAStableRestRun) {
  for (const char* const neuron :
       {"g_CaL = 5", "E_K = 50", "capacitance_uF_per_cm2 = 100", "g_Na = 0", "g_K = 200", "g_L = 5",
        "V_rest = -40", "g_Na = 0\ng_K = 0\ng_CaL = 0"}) {
    run("[neuron]\n" + std::string(neuron) + "\n", 100);
    EXPECT_TRUE(
        TactileModel::create(parse_scene("[neuron]\n" + std::string(neuron) + "\n", "s")->model))
        << neuron;
  }
}

TEST(Scenes, AHandWithItsOwnPatchesKeepsTheProbesThatPressOnThem) {
  const auto one = parse_scene("preset = \"hand\"\n[receptors]\n", "s.toml");
  ASSERT_TRUE(one) << one.error().sentence;
  EXPECT_EQ(one->model.patches.size(), 1U);
  EXPECT_EQ(one->model.indenters.size(), 1U);
  EXPECT_EQ(one->probes.size(), 1U);
  run("preset = \"hand\"\n[receptors]\nlength_mm = 30\nwidth_mm = 20\n", 20);
  const auto two = parse_scene("preset = \"hand\"\n[[receptors]]\n[[receptors]]\n", "s.toml");
  ASSERT_TRUE(two);
  EXPECT_EQ(two->probes.size(), 2U);
  EXPECT_EQ(two->model.indenters[1].patch, 1U);
}

TEST(Scenes, ScenesThatNeedTooMuchMemoryAreRefused) {
  for (const char* const text :
       {"[receptors]\nlength_mm = 1e308\n", "[receptors]\nwidth_mm = 1e308\n",
        "[probe]\ntip = \"pin\"\ndiameter_mm = 1000\n",
        "[probe]\ntip = \"bars\"\nbar_length_mm = 1e6\n",
        "[probe]\ntip = \"bars\"\nbar_widths_mm = [1e6]\nbar_gaps_mm = []\n",
        "[probe]\ntip = \"bars\"\nbar_widths_mm = [90, 90, 90]\nbar_length_mm = 900\n",
        "[[receptors]]\ncount = 6000000\n[[receptors]]\ncount = 6000000\n",
        "preset = \"goodwin\"\n[neuron]\nrefractory_ms = 0.5\n[loop]\ntick_us = 1e8\n"}) {
    const auto scene = parse_scene(text, "s.toml");
    EXPECT_TRUE(!scene || !TactileModel::create(scene->model)) << text;
  }
}

}  // namespace
}  // namespace merkel
