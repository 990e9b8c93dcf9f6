#include "tools/studies/plan/plan.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "tests/tools/program.hpp"
#include "tools/studies/plan/rehearsal.hpp"
#include "tools/studies/reference/cvode_membrane.hpp"

namespace merkel {
namespace {

Scene scene_of(const std::string& text) {
  auto scene = parse_scene(text, "scene.toml");
  EXPECT_TRUE(scene) << scene.error().sentence;
  return std::move(*scene);
}

/// The spikes of a scene's first patch by CVODE, from the currents of all its receptors.
std::vector<SpikeEvent> by_cvode(Scene scene, const Rehearsal& rehearsal) {
  scene.model.accuracy = {.cull_tolerance = 0.0, .freeze_resting = false};
  TactileModel model = *TactileModel::create(scene.model);
  const std::size_t neurons = model.neurons();
  std::vector<std::vector<double>> currents = {std::vector<double>(neurons)};
  std::chrono::nanoseconds time{0};
  for (const auto& contacts : rehearsal.ticks) {
    model.step(contacts, time);
    time += scene.model.tick;
    const auto now = model.patches()[0].drive().output();
    currents.emplace_back(now.begin(), now.end());
  }
  const double tick_ms = units::ms_from(scene.model.tick);
  const double end_ms = tick_ms * static_cast<double>(rehearsal.ticks.size());
  const auto at = [&](std::size_t neuron, double t_ms) {
    const double place = std::min(t_ms / tick_ms, static_cast<double>(currents.size()) - 1.0);
    const auto before = std::min(static_cast<std::size_t>(place), currents.size() - 2);
    const double a = currents[before][neuron];
    const double b = currents[before + 1][neuron];
    return a + (b - a) * (place - static_cast<double>(before));
  };
  std::vector<SpikeEvent> spikes;
  const auto add = [&](const std::vector<reference::CvodeMembranes::Spike>& found,
                       std::size_t first) {
    for (const auto& spike : found) {
      spikes.push_back({.time = units::nanoseconds_from_ms(spike.time_ms),
                        .neuron = static_cast<std::uint32_t>(
                            first + static_cast<std::size_t>(spike.neuron) + 1)});
    }
  };
  reference::CvodeMembranes membranes;
  membranes.relative_tolerance = 1e-8;
  membranes.absolute_tolerance = 1e-10;
  // Restarts, so that no short press is stepped over.
  for (double corner = 5.0; corner < end_ms; corner += 5.0) membranes.corners.push_back(corner);
  if (scene.model.network.gain > 0.0) {
    const auto network = LatticeCoupling::create(scene.model.network, 5, 4);
    membranes.neurons = static_cast<int>(neurons);
    membranes.coupling.assign(neurons, std::vector<double>(neurons, 0.0));
    for (std::size_t n = 0; n < neurons; ++n) {
      for (const auto& [other, g] : {std::pair{n + 1, network->to_next_column()[n]},
                                     std::pair{n + 5, network->to_next_row()[n]}}) {
        if (other < neurons) membranes.coupling[n][other] = membranes.coupling[other][n] = g;
      }
    }
    membranes.current = [&](int n, double t) { return at(static_cast<std::size_t>(n), t); };
    add(membranes.spikes_until(end_ms), 0);
  } else {
    for (std::size_t n = 0; n < neurons; ++n) {
      double largest = 0.0;
      for (const auto& tick : currents) largest = std::max(largest, tick[n]);
      if (largest < 3.0) continue;  // below the rheobase of any stimulus
      membranes.current = [&](int, double t) { return at(n, t); };
      add(membranes.spikes_until(end_ms), n);
    }
  }
  std::sort(spikes.begin(), spikes.end());
  return spikes;
}

TEST(Plan, PredictsTheErrorThatCvodeMeasuresAndMeetsTheBudget) {
#ifdef MERKEL_SANITIZED
  GTEST_SKIP() << "CVODE takes minutes under a sanitizer";
#endif
  const std::vector<std::string> scenes = {
      "[network]\ngain = 0\n[accuracy]\nspike_time_us = 200\n",
      "[network]\ngain = 0\n[accuracy]\nspike_time_us = 20\n[probe]\nuri = "
      "\"sim:taps?depth_mm=2\"\n",
      "[network]\ngain = 0\n[accuracy]\nspike_time_us = 50\n[receptors]\nseed = 5\n[probe]\nuri = "
      "\"sim:sine?depth_mm=2.5\"\n",
      "[network]\ngain = 0\n[accuracy]\nspike_time_us = 5\n[probe]\nradius_mm = 4\n",
      "[accuracy]\nspike_time_us = 50\n"};
  for (const std::string& text : scenes) {
    Scene scene = scene_of(text);
    const auto plan = make_plan(scene);
    ASSERT_TRUE(plan) << plan.error().sentence;
    EXPECT_EQ(std::get<HodgkinHuxleyAfferent>(scene.model.afferent).method, plan->chosen.method);
    EXPECT_LE(plan->chosen.error_us(), *plan->budget_us) << text;

    const auto rehearsal = rehearse(scene, std::chrono::seconds{1});
    ASSERT_TRUE(rehearsal);
    TactileModel model = *TactileModel::create(scene.model);
    const std::vector<SpikeEvent> spikes = run_through(model, *rehearsal);
    const SpikeTrainError measured = spike_train_error(spikes, by_cvode(scene, *rehearsal));
    EXPECT_GT(measured.matched, 5U) << text;
    EXPECT_EQ(measured.unmatched, 0U) << text;
    EXPECT_LE(1e3 * measured.rms_ms, 1.02 * *plan->budget_us) << text;
    EXPECT_GT(1e3 * measured.rms_ms, 0.5 * plan->chosen.error_us()) << text;
    EXPECT_LT(1e3 * measured.rms_ms, 2.0 * plan->chosen.error_us()) << text;
  }
}

TEST(Plan, SaysWhatIsComputedAndWhatIsLeftOut) {
  const auto run = run_program({"plan", "paper", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* const part :
       {"\"method\": \"crank_nicolson\"", "\"left_out\"", "beyond reach", "none is asked for"}) {
    EXPECT_NE(run.out.find(part), std::string::npos) << part;
  }
  const auto uncoupled = run_program({"plan", "hand"});
  EXPECT_EQ(uncoupled.exit_code, 0) << uncoupled.err;
  EXPECT_NE(uncoupled.out.find("coupling: network.gain is 0"), std::string::npos);
}

TEST(Plan, RefusesABudgetThatNoMethodMeetsAndNamesTheBest) {
  const auto run = run_program({"plan", "--spike-time-us", "0.00001"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("accuracy.spike_time_us cannot be met: the best is"), std::string::npos);
  EXPECT_NE(run.err.find("rk4 in double"), std::string::npos);
}

}  // namespace
}  // namespace merkel
