// Complete scenes whose afferents have receptive fields, adaptation and noisy neurons.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/contact/huber_stress.hpp"
#include "core/scene/tactile_model.hpp"
#include "core/scene/tactile_patch.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tests/core/every_simd_target.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

TactileModel::Parameters fingertip() {
  TactileModel::Parameters parameters;
  parameters.skin.radius_mm = 7.0;
  parameters.patches.front().layout = ReceptorLayout::kFields;
  set_kind(parameters, NeuronKind::kIntegrateAndFire);
  parameters.network.gain = 0.0;
  return parameters;
}

TactileModel driven_model(const TactileModel::Parameters& parameters) {
  auto model = TactileModel::create(parameters);
  EXPECT_TRUE(model) << model.error().key << " " << model.error().reason;
  return std::move(*model);
}

std::vector<SpikeEvent> press(TactileModel& model, const ContactInput& input, nanoseconds length) {
  std::vector<SpikeEvent> all;
  const nanoseconds tick = model.parameters().tick;
  for (nanoseconds time{0}; time < length; time += tick) {
    const auto spikes = model.step({&input, 1}, time);
    all.insert(all.end(), spikes.begin(), spikes.end());
  }
  return all;
}

constexpr ContactInput kPress{.depth_mm = 1.0, .force_mN = 196.0, .x_mm = 15.0, .y_mm = 10.0};

TEST(EnergyDriven, TheFingertipHas450AfferentsOf28Receptors) {
  const TactileModel model = driven_model(fingertip());
  EXPECT_EQ(model.neurons(), 450U);
  EXPECT_EQ(model.receptors(), 12'600U);
}

TEST(EnergyDriven, TheDriveIsTheAdaptedMeanOfTheEnergyDensities) {
  TactileModel::Parameters parameters = fingertip();
  parameters.patches.front().centres = {{15.0, 10.0}, {17.0, 10.0}, {25.0, 4.0}};
  parameters.accuracy.cull_tolerance = 0.0;
  TactileModel model = driven_model(parameters);
  static_cast<void>(press(model, kPress, microseconds{1000}));
  const auto contact = model.press(0, kPress).contact;
  const SkinMaterial material(parameters.skin);
  const auto& drive = model.patches().front().drive();
  for (std::size_t n = 0; n < 3; ++n) {
    double mean = 0.0;
    for (std::size_t k = 28 * n; k < 28 * (n + 1); ++k) {
      const Receptor& receptor = drive.receptors()[k];
      mean += energy_density_kPa(
                  huber_stress(contact, parameters.skin.poisson_ratio,
                               std::hypot(receptor.x_mm - 15.0, receptor.y_mm - 10.0), 0.65),
                  material, parameters.skin.energy_density) /
              28.0;
    }
    EXPECT_NEAR(drive.output()[n], mean, 1e-9 * mean) << n;
  }
}

TEST(EnergyDriven, CullingBarelyChangesTheDrive) {
  TactileModel::Parameters parameters = fingertip();
  TactileModel culled = driven_model(parameters);
  parameters.accuracy.cull_tolerance = 0.0;
  TactileModel all = driven_model(parameters);
  static_cast<void>(press(culled, kPress, microseconds{1000}));
  static_cast<void>(press(all, kPress, microseconds{1000}));
  const auto& fewer = culled.patches().front().drive();
  EXPECT_LT(fewer.afferents_reached(), 440U);
  for (std::size_t n = 0; n < 450; ++n) {
    EXPECT_NEAR(fewer.output()[n], all.patches().front().drive().output()[n], 1e-4);
  }
}

TEST(EnergyDriven, CullingOnStiffeningSkinKeepsItsTolerance) {
  constexpr double kTolerance_kPa = 0.01;
  constexpr ContactInput kDeepPress{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0};
  for (const Tip& tip : {Tip{}, Tip{PinTip{}}}) {
    TactileModel::Parameters parameters = fingertip();
    parameters.skin.stiffening_mm = 0.5;
    parameters.indenters.front().tip = tip;
    parameters.accuracy.cull_tolerance = kTolerance_kPa;
    TactileModel culled = driven_model(parameters);
    parameters.accuracy.cull_tolerance = 0.0;
    TactileModel all = driven_model(parameters);
    static_cast<void>(press(culled, kDeepPress, microseconds{1000}));
    static_cast<void>(press(all, kDeepPress, microseconds{1000}));
    const auto& fewer = culled.patches().front().drive();
    double largest_error_kPa = 0.0;
    for (std::size_t n = 0; n < 450; ++n) {
      largest_error_kPa =
          std::max(largest_error_kPa,
                   std::fabs(fewer.output()[n] - all.patches().front().drive().output()[n]));
    }
    EXPECT_LE(largest_error_kPa, kTolerance_kPa) << tip.index();
    if (std::holds_alternative<SphereTip>(tip)) {
      // Neither more nor fewer than needed: 146, where the press of skin at rest would reach all.
      EXPECT_GE(largest_error_kPa, 0.1 * kTolerance_kPa);
      EXPECT_LE(fewer.afferents_reached(), 160U);
    }
  }
}

TEST(EnergyDriven, ForceControlFollowsTheCurvatureOfFingerAndIndenter) {
  for (const double radius : {1.44, 5.0, std::numeric_limits<double>::infinity()}) {
    TactileModel::Parameters parameters = fingertip();
    parameters.indenters.front().tip = SphereTip{radius};
    parameters.indenters.front().control = Indenter::Control::kForce;
    const TactileModel model = driven_model(parameters);
    const double effective = 1.0 / (1.0 / radius + 1.0 / 7.0);
    const double reduced = SkinMaterial(parameters.skin).reduced_modulus_kPa();
    EXPECT_NEAR(model.press(0, kPress).contact.contact_radius_mm,
                std::cbrt(3.0 * 196.0 * effective / (4.0 * reduced)), 1e-9);
  }
}

TEST(EnergyDriven, AContactBesideTheApexOfTheFingerIsShifted) {
  TactileModel::Parameters parameters = fingertip();
  parameters.skin.apex = {.x_mm = 15.0, .y_mm = 10.0};
  const ContactInput beside{.depth_mm = 0.5, .x_mm = 17.0, .y_mm = 9.0};
  for (const double radius : {2.0, 7.0, std::numeric_limits<double>::infinity()}) {
    parameters.indenters.front().tip = SphereTip{radius};
    const Press made = driven_model(parameters).press(0, beside);
    const double k = 1.0 / radius;
    const double kept = k / (k + 1.0 / 7.0);
    EXPECT_NEAR(made.x_mm, 15.0 + 2.0 * kept, 1e-12);
    EXPECT_NEAR(made.y_mm, 10.0 - kept, 1e-12);

    // Along the finger, its own radius decides.
    TactileModel::Parameters long_finger = parameters;
    long_finger.skin.radius_along_mm = 14.0;
    const Press along = driven_model(long_finger).press(0, beside);
    EXPECT_NEAR(along.x_mm, 15.0 + 2.0 * k / (k + 1.0 / 14.0), 1e-12);
    EXPECT_EQ(along.y_mm, made.y_mm);
  }
}

TEST(EnergyDriven, ReplaysBitIdenticallyOnEveryInstructionSet) {
  TactileModel::Parameters parameters = fingertip();
  parameters.patches.front().receptors.count = 100;
  TactileModel model = driven_model(parameters);
  const auto spikes = on_every_simd_target([&] {
    model.reset();
    return press(model, kPress, microseconds{300'000});
  });
  EXPECT_GT(spikes.size(), 40U);
}

TEST(EnergyDriven, ALongerTickChangesLittleUnderASteadyPress) {
  TactileModel::Parameters parameters = fingertip();
  TactileModel fine = driven_model(parameters);
  parameters.tick = microseconds{5000};
  TactileModel coarse = driven_model(parameters);
  // After the onset, which falls within one tick, the drive and the noise are the same.
  const auto after_onset = [](const std::vector<SpikeEvent>& spikes) {
    return static_cast<double>(std::count_if(spikes.begin(), spikes.end(), [](const auto& spike) {
      return spike.time > microseconds{100'000};
    }));
  };
  const double expected = after_onset(press(fine, kPress, microseconds{1'000'000}));
  EXPECT_NEAR(after_onset(press(coarse, kPress, microseconds{1'000'000})), expected,
              0.01 * expected);
}

TEST(EnergyDriven, HodgkinHuxleyNeuronsCanHaveFieldsToo) {
  TactileModel::Parameters parameters;
  parameters.patches.front().layout = ReceptorLayout::kFields;
  EXPECT_EQ(TactileModel::create(parameters).error().key, "network.gain");
  parameters.network.gain = 0.0;
  TactileModel model = driven_model(parameters);
  EXPECT_EQ(model.neurons(), 450U);
  EXPECT_GT(press(model, kPress, microseconds{200'000}).size(), 100U);
}

TEST(EnergyDriven, PatchesDifferInNoise) {
  TactileModel::Parameters parameters = fingertip();
  parameters.patches.front().centres = {{15.0, 10.0}};
  parameters.patches.push_back(parameters.patches.front());
  parameters.indenters.push_back(parameters.indenters.front());
  parameters.indenters.back().patch = 1;
  TactileModel model = driven_model(parameters);
  const ContactInput both[] = {kPress, kPress};
  std::vector<nanoseconds> first;
  std::vector<nanoseconds> second;
  for (int k = 0; k < 500; ++k) {
    for (const SpikeEvent& spike : model.step(both, k * microseconds{1000})) {
      (spike.patch == 0 ? first : second).push_back(spike.time);
    }
  }
  EXPECT_GT(first.size(), 10U);
  EXPECT_NE(first, second);
}

}  // namespace
}  // namespace merkel
