#include "core/scene/tactile_model.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

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

TEST(TactileModel, AConstantCentrePressDrivesNeurons8And13Alone) {
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

TEST(TactileModel, NoContactGivesNoSpike) {
  TactileModel model = model_of();
  for (const double depth : {0.0, -1.0}) {
    const ContactInput input{.depth_mm = depth, .x_mm = 15.0, .y_mm = 10.0};
    EXPECT_TRUE(press(model, {&input, 1}, 1000).empty());
  }
  const auto currents = model.patches()[0].current_uA_per_cm2();
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
  by_force.indenters = {{.radius_mm = 2.0, .control = Indenter::Control::kForce}};
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

TEST(TactileModel, CloseContactsAreNoticed) {
  TactileModel::Parameters parameters;
  parameters.indenters = {Indenter{}, Indenter{}};
  TactileModel model = model_of(parameters);
  const double a = model.press(0, {.depth_mm = 0.5}).contact.contact_radius_mm;
  const auto at = [&](double apart) {
    const std::vector<ContactInput> inputs = {
        {.depth_mm = 0.5, .x_mm = 10.0, .y_mm = 10.0},
        {.depth_mm = 0.5, .x_mm = 10.0 + apart, .y_mm = 10.0}};
    model.step(inputs, nanoseconds{0});
    return model.closest_rims();
  };
  EXPECT_NEAR(at(5.0 * a), 3.0, 1e-12);
  EXPECT_NEAR(at(2.5 * a), 0.5, 1e-12);
  EXPECT_NEAR(at(9.0 * a), 0.5, 1e-12);  // the closest so far
}

TEST(TactileModel, TheEnergyUnderBarsGrowsWithTheSquareOfTheDepth) {
  TactileModel::Parameters parameters;
  parameters.indenters = {{.tip = Indenter::Tip::kBars}};
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
  TactileModel one = model_of(parameters);
  parameters.indenters = {Indenter{}, Indenter{}};
  TactileModel both = model_of(parameters);
  const ContactInput input{.depth_mm = 0.5, .x_mm = 15.0, .y_mm = 10.0};
  both.step(std::vector<ContactInput>{input, input}, nanoseconds{0});
  one.step({&input, 1}, nanoseconds{0});
  for (std::size_t i = 0; i < 450; ++i) {
    const double expected = 4.0 * energies(one)[i];
    EXPECT_NEAR(energies(both)[i], expected, 1e-12 * (1.0 + expected));
  }
}

TEST(TactileModel, RefusesWhatCannotBe) {
  const auto key_of = [](auto change) {
    TactileModel::Parameters parameters;
    change(parameters);
    const auto model = TactileModel::create(parameters);
    return model ? std::string("none") : model.error().key;
  };
  using P = TactileModel::Parameters;
  EXPECT_EQ(key_of([](P& p) { p.indenters[0].radius_mm = -2.0; }), "probe.radius_mm");
  EXPECT_EQ(key_of([](P& p) { p.indenters.clear(); }), "probe");
  EXPECT_EQ(key_of([](P& p) { p.step = nanoseconds{0}; }), "neuron.step_us");
  EXPECT_EQ(key_of([](P& p) { p.step = nanoseconds{30'000}; }), "neuron.step_us");
  EXPECT_EQ(key_of([](P& p) { p.tick = milliseconds{-1}; }), "loop.tick_us");
  EXPECT_EQ(key_of([](P& p) { p.skin.poisson_ratio = 0.5; }), "skin.poisson_ratio");
  EXPECT_EQ(
      key_of([](P& p) { p.indenters[0].radius_mm = std::numeric_limits<double>::infinity(); }),
      "probe.radius_mm");
}

}  // namespace
}  // namespace merkel
