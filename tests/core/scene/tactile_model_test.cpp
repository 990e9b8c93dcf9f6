#include "core/scene/tactile_model.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene/tactile_patch.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

TactileModel model_of(const TactileModel::Parameters& parameters = {}) {
  auto model = TactileModel::create(parameters);
  EXPECT_TRUE(model) << model.error().key << " " << model.error().reason;
  return std::move(*model);
}

std::vector<SpikeEvent> press(TactileModel& model, std::span<const ContactInput> inputs,
                              int ticks) {
  std::vector<SpikeEvent> all;
  for (int k = 0; k < ticks; ++k) {
    const auto spikes = model.step(inputs, k * model.parameters().tick);
    all.insert(all.end(), spikes.begin(), spikes.end());
  }
  return all;
}

std::vector<int> counts(const std::vector<SpikeEvent>& spikes) {
  std::vector<int> of_neuron(21);
  for (const SpikeEvent& spike : spikes) ++of_neuron[spike.neuron];
  return of_neuron;
}

std::vector<double> energies(const TactileModel& model) {
  const ReceptorDrive& drive = model.patches()[0].drive();
  std::vector<double> all;
  for (std::size_t i = 0; i < drive.receptors().size(); ++i) {
    all.push_back(drive.energy_density_kPa(i));
  }
  return all;
}

TEST(TactileModel, AConstantCentrePressDrivesOnlyNeurons8And13) {
  for (const auto placement :
       {ReceptorParameters::Placement::kRandom, ReceptorParameters::Placement::kLattice}) {
    TactileModel::Parameters parameters;
    parameters.patches[0].receptors.placement = placement;
    TactileModel model = model_of(parameters);
    const ContactInput input{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0};
    const auto of_neuron = counts(press(model, {&input, 1}, 1000));
    EXPECT_GT(of_neuron[8], 40);
    EXPECT_GT(of_neuron[13], 40);
    for (int n = 1; n <= 20; ++n) {
      if (n != 8 && n != 13) {
        EXPECT_EQ(of_neuron[static_cast<std::size_t>(n)], 0) << "neuron " << n;
      }
    }
  }
}

TEST(Afferents, EqualPatchesShareWhatTakesLongToCompute) {
  TactileModel::Parameters parameters;
  parameters.patches.resize(2, parameters.patches.front());
  const auto tables = afferent_tables_of(parameters);
  const auto shares = [](const auto& table) { return table.use_count(); };
  ASSERT_EQ(shares(tables.resting_states), 1);
  const auto one = Afferents::create(parameters, 0, 20, tables);
  const auto other = Afferents::create(parameters, 1, 20, tables);
  ASSERT_TRUE(one && other);
  EXPECT_EQ(shares(tables.resting_states), 3);
}

TEST(TactileModel, FiveHundredPatchesTakeLessThanAHundredTimesTheSetUpOfOne) {
  // The median processor time of three: 20 times that of one, 500 times with tables of their own.
  const auto set_up_s = [](std::size_t patches) {
    TactileModel::Parameters parameters;
    parameters.patches.resize(patches, parameters.patches.front());
    std::array<double, 3> times{};
    for (double& time : times) {
      const std::clock_t begin = std::clock();
      EXPECT_TRUE(TactileModel::create(parameters));
      time = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    }
    std::sort(times.begin(), times.end());
    return times[1];
  };
  EXPECT_LT(set_up_s(500), 100.0 * set_up_s(1));
}

TEST(TactileModel, ReportsDriveAndPotentialByNeuronNumberAcrossPatches) {
  TactileModel::Parameters parameters;
  parameters.patches.push_back(parameters.patches.front());
  parameters.indenters[0].patch = 1;
  TactileModel model = model_of(parameters);
  const std::vector<ContactInput> inputs = {{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0}};
  float lowest = 1e9F;
  float highest = -1e9F;
  for (int k = 0; k < 200; ++k) {
    static_cast<void>(model.step(inputs, k * parameters.tick));
    const NeuronSample pressed = model.neuron(28);  // number 8 of the second patch
    EXPECT_EQ(pressed.neuron, 28U);
    EXPECT_EQ(pressed.drive, static_cast<float>(model.patches()[1].drive().output()[7]));
    lowest = std::min(lowest, pressed.potential);
    highest = std::max(highest, pressed.potential);
  }
  EXPECT_GT(highest - lowest, 50.0F);  // it fires
  EXPECT_EQ(model.neuron(8).drive, 0.0F);
  EXPECT_NEAR(model.neuron(8).potential, model.neuron(1).potential, 1e-3);
}

TEST(TactileModel, NoContactGivesNoSpike) {
  TactileModel model = model_of();
  for (const double depth : {0.0, -1.0}) {
    const ContactInput input{.depth_mm = depth, .x_mm = 15.0, .y_mm = 10.0};
    EXPECT_TRUE(press(model, {&input, 1}, 1000).empty());
  }
  const auto currents = model.patches()[0].drive().output();
  EXPECT_TRUE(
      std::all_of(currents.begin(), currents.end(), [](double current) { return current == 0.0; }));
}

TEST(TactileModel, SpikesComeInOrderWithinTheirTick) {
  TactileModel model = model_of();
  const ContactInput input{.depth_mm = 3.0, .x_mm = 12.0, .y_mm = 10.0};
  for (int k = 0; k < 500; ++k) {
    const auto begin = k * model.parameters().tick;
    const auto spikes = model.step({&input, 1}, begin);
    EXPECT_TRUE(std::is_sorted(spikes.begin(), spikes.end()));
    for (const SpikeEvent& spike : spikes) {
      EXPECT_GE(spike.time, begin);
      EXPECT_LE(spike.time, begin + model.parameters().tick);
    }
  }
}

TEST(TactileModel, ResetRepeatsTheRunBitForBit) {
  TactileModel model = model_of();
  const ContactInput input{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0};
  const auto first = press(model, {&input, 1}, 300);
  model.reset();
  EXPECT_EQ(press(model, {&input, 1}, 300), first);
  EXPECT_FALSE(first.empty());
}

TEST(TactileModel, ForceControlEqualsDepthControlAtTheSameContact) {
  TactileModel::Parameters by_force;
  by_force.indenters = {{.tip = SphereTip{2.0}, .control = Indenter::Control::kForce}};
  TactileModel force_model = model_of(by_force);
  TactileModel depth_model = model_of();
  const ContactInput depth{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0};
  const ContactInput force{
      .force_mN = depth_model.press(0, depth).contact.force_mN, .x_mm = 15.0, .y_mm = 10.0};
  EXPECT_NEAR(force_model.press(0, force).contact.depth_mm, 1.5, 1e-12);
  EXPECT_EQ(counts(press(force_model, {&force, 1}, 300)),
            counts(press(depth_model, {&depth, 1}, 300)));
}

TEST(TactileModel, TwoProbesActTogether) {
  TactileModel::Parameters parameters;
  parameters.indenters = {Indenter{}, Indenter{}};
  TactileModel both = model_of(parameters);
  const std::vector<ContactInput> inputs = {{.depth_mm = 1.5, .x_mm = 9.0, .y_mm = 7.5},
                                            {.depth_mm = 1.5, .x_mm = 21.0, .y_mm = 12.5}};
  const auto of_neuron = counts(press(both, inputs, 500));
  EXPECT_GT(of_neuron[7], 0);
  EXPECT_GT(of_neuron[14], 0);
}

TEST(TactileModel, RemembersTheDeepestPress) {
  TactileModel model = model_of();
  for (const double depth : {0.5, 1.25, 0.7}) {
    const ContactInput input{.depth_mm = depth, .x_mm = 3.0, .y_mm = 4.0};
    model.step({&input, 1}, nanoseconds{0});
  }
  EXPECT_EQ(model.deepest()[0].contact.depth_mm, 1.25);
  EXPECT_EQ(model.deepest()[0].x_mm, 3.0);
}

TEST(TactileModel, DetectsCloseContacts) {
  TactileModel::Parameters parameters;
  parameters.indenters = {{.control = Indenter::Control::kForce},
                          {.control = Indenter::Control::kForce}};
  TactileModel model = model_of(parameters);
  const double a = model.press(0, {.force_mN = 60.0}).contact.contact_radius_mm;
  const auto at = [&](double apart) {
    const std::vector<ContactInput> inputs = {
        {.force_mN = 60.0, .x_mm = 10.0, .y_mm = 10.0},
        {.force_mN = 60.0, .x_mm = 10.0 + apart, .y_mm = 10.0}};
    model.step(inputs, nanoseconds{0});
    return model.closest_rims();
  };
  EXPECT_NEAR(at(5.0 * a), 3.0, 1e-12);
  EXPECT_NEAR(at(2.5 * a), 0.5, 1e-12);
  EXPECT_NEAR(at(9.0 * a), 0.5, 1e-12);  // the closest so far
}

TEST(TactileModel, TheEnergyUnderBarsGrowsWithTheSquareOfTheDepth) {
  TactileModel::Parameters parameters;
  parameters.indenters = {{.tip = BarTip{}}};
  TactileModel model = model_of(parameters);
  const auto energy = [&](double depth, double x) {
    const ContactInput input{.depth_mm = depth, .x_mm = x, .y_mm = 10.0};
    model.step({&input, 1}, nanoseconds{0});
    return energies(model);
  };
  const auto shallow = energy(0.5, 15.0);
  const auto deep = energy(1.0, 15.0);
  for (std::size_t i = 0; i < deep.size(); ++i) EXPECT_NEAR(deep[i], 4.0 * shallow[i], 1e-12);
  EXPECT_NE(energy(1.0, 14.0), deep);  // the tip moved
}

TEST(TactileModel, TwoProbesAtOnePlaceAreTheSumOfTheirStresses) {
  TactileModel::Parameters parameters;
  parameters.accuracy.cull_tolerance = 0.0;
  parameters.indenters = {{.control = Indenter::Control::kForce}};
  TactileModel one = model_of(parameters);
  parameters.indenters.push_back(parameters.indenters.front());
  TactileModel both = model_of(parameters);
  const ContactInput input{.force_mN = 60.0, .x_mm = 15.0, .y_mm = 10.0};
  both.step(std::vector<ContactInput>{input, input}, nanoseconds{0});
  one.step({&input, 1}, nanoseconds{0});
  for (std::size_t i = 0; i < 450; ++i) {
    const double expected = 4.0 * energies(one)[i];
    EXPECT_NEAR(energies(both)[i], expected, 1e-12 * (1.0 + expected));
  }
}

TEST(TactileModel, DepthControlledProbesShareTheSkinThatTheyDisplace) {
  TactileModel::Parameters parameters;
  parameters.indenters = {Indenter{}, Indenter{}};
  TactileModel model = model_of(parameters);
  const ContactInput left{.depth_mm = 1.0, .x_mm = 13.0, .y_mm = 10.0};
  const ContactInput right{.depth_mm = 1.0, .x_mm = 17.0, .y_mm = 10.0};
  model.step(std::vector<ContactInput>{left, right}, nanoseconds{0});
  const double alone = model.press(0, left).contact.force_mN;
  EXPECT_NEAR(alone / model.deepest()[0].contact.force_mN, 1.22, 0.01);
  EXPECT_NEAR(alone / model.deepest()[1].contact.force_mN, 1.22, 0.01);
  // A neighbour that does not touch has no effect.
  model.reset();
  model.step(std::vector<ContactInput>{left, ContactInput{}}, nanoseconds{0});
  EXPECT_EQ(model.deepest()[0].contact.force_mN, alone);
}

TEST(TactileModel, RefusesInvalidParameters) {
  const auto key_of = [](auto change) {
    TactileModel::Parameters parameters;
    change(parameters);
    const auto model = TactileModel::create(parameters);
    return model ? std::string("none") : model.error().key;
  };
  using P = TactileModel::Parameters;
  EXPECT_EQ(key_of([](P& p) { p.indenters[0].tip = SphereTip{-2.0}; }), "probe.radius_mm");
  EXPECT_EQ(key_of([](P& p) { p.indenters.clear(); }), "probe");
  EXPECT_EQ(key_of([](P& p) { p.step = nanoseconds{0}; }), "neuron.step_us");
  EXPECT_EQ(key_of([](P& p) { p.step = nanoseconds{30'000}; }), "neuron.step_us");
  EXPECT_EQ(key_of([](P& p) { p.tick = milliseconds{-1}; }), "loop.tick_us");
  EXPECT_EQ(key_of([](P& p) { p.patches.clear(); }), "patch");
  EXPECT_EQ(key_of([](P& p) { p.indenters[0].patch = 1; }), "probe.patch");
  EXPECT_EQ(key_of([](P& p) { p.accuracy.cull_tolerance = 1.0; }), "accuracy.cull_tolerance");
  EXPECT_EQ(key_of([](P& p) { p.skin.poisson_ratio = 0.5; }), "skin.poisson_ratio");
  EXPECT_EQ(
      key_of([](P& p) { p.indenters[0].tip = SphereTip{std::numeric_limits<double>::infinity()}; }),
      "probe.radius_mm");
}

// Placing ten million receptors takes half a minute: none is placed before all are counted.
TEST(TactileModel, RefusesScenesThatAreTooLarge) {
  const auto fault_of = [](auto change) {
    TactileModel::Parameters parameters;
    parameters.patches = {{.name = "thumb"}, {.name = "index"}};
    for (PatchParameters& patch : parameters.patches) change(parameters, patch);
    const auto model = TactileModel::create(parameters);
    return model ? "none" : model.error().key + " " + model.error().reason;
  };
  using P = TactileModel::Parameters;
  const std::string too_many =
      " gives more receptors in all patches than a scene can hold (10000000)";
  EXPECT_EQ(fault_of([](P&, PatchParameters& each) { each.receptors.count = 6'000'000; }),
            "receptors.count" + too_many);
  EXPECT_EQ(fault_of([](P&, PatchParameters& each) { each.receptors.density_per_mm2 = 9'999.0; }),
            "receptors.density_per_mm2" + too_many);
  const auto fields = [&](std::int64_t afferents, std::int64_t receptors) {
    return fault_of([&](P& p, PatchParameters& each) {
      p.network.gain = 0.0;
      p.tick = std::chrono::seconds{1};
      each.layout = ReceptorLayout::kFields;
      each.receptors.count = afferents;
      each.field.receptors = receptors;
    });
  };
  EXPECT_EQ(fields(3'000, 2'000), "receptors.count" + too_many);
  EXPECT_EQ(fault_of([](P& p, PatchParameters& each) {
              p.network.gain = 0.0;
              each.layout = ReceptorLayout::kFields;
              each.centres.assign(1'000, {.x_mm = 1.0, .y_mm = 1.0});
              each.field.receptors = 6'000;
            }),
            "receptors.centres_mm" + too_many);
  EXPECT_EQ(fields(6'000, 20),
            "loop.tick_us is so long that the afferents could fire more than 10000000 spikes in a "
            "tick: make it shorter");
  const auto wrong = [](P&, PatchParameters& each) {
    each.receptors.count = 6'000'000;
    each.patch.length_mm = -1.0;
  };
  EXPECT_EQ(fault_of(wrong).substr(0, 19), "receptors.length_mm");
}

std::string step_fault(IntegrationMethod method, nanoseconds step, double gain = 0.1) {
  TactileModel::Parameters parameters;
  parameters.afferent = HodgkinHuxleyAfferent{.method = method};
  parameters.step = step;
  parameters.network.gain = gain;
  const auto model = TactileModel::create(parameters);
  return model ? "" : model.error().key + " " + model.error().reason;
}

TEST(TactileModel, RefusesAStepAtWhichItsMethodFails) {
  EXPECT_EQ(step_fault(IntegrationMethod::kForwardEuler, nanoseconds{50'000}), "");
  EXPECT_EQ(step_fault(IntegrationMethod::kForwardEuler, nanoseconds{100'000}, 0.0),
            "neuron.step_us must be at most 55 for forward_euler, but is 100: use 50");
  EXPECT_EQ(step_fault(IntegrationMethod::kRk4, nanoseconds{100'000}, 0.0),
            "neuron.step_us must be at most 80 for rk4, but is 100: use 62.5");
  EXPECT_EQ(step_fault(IntegrationMethod::kCrankNicolson, nanoseconds{100'000}), "");
  EXPECT_NE(step_fault(IntegrationMethod::kRk4, nanoseconds{25'000}, 100.0)
                .find("for rk4 in this network"),
            std::string::npos);
  EXPECT_NE(step_fault(IntegrationMethod::kCrankNicolson, nanoseconds{25'000}, 100.0)
                .find("for crank_nicolson in this network"),
            std::string::npos);
  EXPECT_NE(step_fault(IntegrationMethod::kCrankNicolson, nanoseconds{25'000}, 1e5).find("gain"),
            std::string::npos);
  // The suggested step works.
  EXPECT_EQ(step_fault(IntegrationMethod::kRk4, nanoseconds{62'500}, 0.0), "");
}

/// Two patches with a probe each and one without.
TactileModel::Parameters three_patches() {
  TactileModel::Parameters parameters;
  parameters.patches = {{.name = "thumb"}, {.name = "index"}, {.name = "middle"}};
  parameters.patches[1].receptors.seed = 2;
  parameters.indenters = {{.patch = 0}, {.patch = 1}};
  return parameters;
}

TEST(TactileModel, ProbesActOnlyOnTheirOwnPatch) {
  TactileModel hand = model_of(three_patches());
  TactileModel finger = model_of();
  EXPECT_EQ(hand.neurons(), 60U);
  EXPECT_EQ(hand.receptors(), 1350U);
  const ContactInput deep{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0};
  const ContactInput none{};
  const auto on_hand = press(hand, std::vector<ContactInput>{deep, none}, 300);
  EXPECT_EQ(on_hand, press(finger, {&deep, 1}, 300));  // patch 0 is the paper's patch
  EXPECT_FALSE(hand.patches()[0].asleep());
  EXPECT_TRUE(hand.patches()[1].asleep());
  EXPECT_TRUE(hand.patches()[2].asleep());

  hand.reset();
  const auto on_both = press(hand, std::vector<ContactInput>{deep, deep}, 300);
  EXPECT_TRUE(std::is_sorted(on_both.begin(), on_both.end()));
  EXPECT_GT(std::count_if(on_both.begin(), on_both.end(),
                          [](const SpikeEvent& spike) { return spike.patch == 1; }),
            10);
  // Neurons are numbered across all patches.
  for (const SpikeEvent& spike : on_both) {
    EXPECT_GT(spike.neuron, 20U * spike.patch);
    EXPECT_LE(spike.neuron, 20U * (spike.patch + 1U));
  }
}

TEST(TactileModel, ASkippedPatchResumesExactly) {
  TactileModel::Parameters parameters;
  TactileModel frozen = model_of(parameters);
  parameters.accuracy.freeze_resting = false;
  TactileModel stepped = model_of(parameters);
  std::vector<SpikeEvent> spikes[2];
  for (int k = 0; k < 1200; ++k) {
    const bool pressed = k % 400 > 200;
    const ContactInput input{.depth_mm = pressed ? 1.5 : 0.0, .x_mm = 15.0, .y_mm = 10.0};
    const auto begin = k * milliseconds{1};
    for (const SpikeEvent& spike : frozen.step({&input, 1}, begin)) spikes[0].push_back(spike);
    for (const SpikeEvent& spike : stepped.step({&input, 1}, begin)) spikes[1].push_back(spike);
    if (k == 190) {
      EXPECT_TRUE(frozen.patches()[0].asleep());
    }
  }
  ASSERT_EQ(spikes[0].size(), spikes[1].size());
  ASSERT_GT(spikes[0].size(), 20U);
  for (std::size_t i = 0; i < spikes[0].size(); ++i) {
    EXPECT_LE(std::abs((spikes[0][i].time - spikes[1][i].time).count()), 1000);
  }
}

TEST(TactileModel, CullingBarelyMovesSpikes) {
  TactileModel::Parameters parameters;
  TactileModel culled = model_of(parameters);
  parameters.accuracy.cull_tolerance = 0.0;
  TactileModel whole = model_of(parameters);
  const ContactInput input{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0};
  const auto a = press(culled, {&input, 1}, 500);
  const auto b = press(whole, {&input, 1}, 500);
  EXPECT_LT(culled.patches()[0].drive().afferents_reached(), 20U);
  EXPECT_EQ(whole.patches()[0].drive().afferents_reached(), 20U);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LE(std::abs((a[i].time - b[i].time).count()), 20'000);
  }
}

}  // namespace
}  // namespace merkel
