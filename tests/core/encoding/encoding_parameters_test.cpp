#include "core/encoding/encoding_parameters.hpp"

#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "core/encoding/stimulation_encoder.hpp"

namespace merkel {
namespace {

EncodingParameters valid() {
  Electrode electrode{.name = "E1"};
  electrode.amplitude_uA = {20.0, 80.0};
  electrode.frequency_Hz = {0.0, 200.0};
  EncodingParameters parameters;
  parameters.electrodes = {electrode};
  parameters.stimulation.max_charge_nC = 16.0;
  parameters.stimulation.max_total_uA = 300.0;
  parameters.stimulation.watchdog = std::chrono::milliseconds{100};
  return parameters;
}

std::string fault(const std::function<void(EncodingParameters&)>& change) {
  EncodingParameters parameters = valid();
  change(parameters);
  const auto checked = parameters.check();
  return checked ? "" : checked.error().key + " " + checked.error().reason;
}

TEST(EncodingParameters, AcceptsValidParametersAndNoElectrodes) {
  EXPECT_TRUE(valid().check());
  EXPECT_TRUE(EncodingParameters{}.check());
}

TEST(EncodingParameters, ACommandIsValidUntilTheNextUpdate) {
  const auto fault_of_update = [](std::chrono::milliseconds update) {
    return fault([update](auto& p) { p.stimulation.update = update; });
  };
  EXPECT_EQ(fault_of_update(std::chrono::milliseconds{99}), "");
  EXPECT_EQ(
      fault_of_update(std::chrono::milliseconds{100}),
      "stimulation.update_ms must be shorter than stimulation.watchdog_ms = 100: a command is "
      "valid for the watchdog, so electrodes would be off until the next update");
}

TEST(EncodingParameters, LimitsHaveNoDefault) {
  EXPECT_EQ(fault([](auto& p) { p.stimulation.max_charge_nC = 0.0; }),
            "stimulation.max_charge_nC must be set to a positive number: a scene with electrodes "
            "needs this limit, and merkel has no default for it");
  EXPECT_EQ(fault([](auto& p) {
              p.stimulation.max_charge_nC = 0.9;
              p.electrodes[0].amplitude_uA = {1.0, 4.0};
            }),
            "");
  EXPECT_EQ(fault([](auto& p) {
              p.stimulation.max_total_uA = 0.9;
              p.electrodes[0].amplitude_uA = {0.1, 0.5};
            }),
            "");
  EXPECT_EQ(fault([](auto& p) {
              p.stimulation.max_charge_nC = 0.0;
              p.electrodes.push_back(p.electrodes[0]);
              p.electrodes[1].name = "E2";
              p.electrodes[1].max_charge_nC = 16.0;
            }).find("stimulation.max_charge_nC must be set"),
            0U);
  EXPECT_EQ(fault([](auto& p) {
              p.stimulation.max_total_uA = 0.0;
            }).find("stimulation.max_total_uA must be set"),
            0U);
  EXPECT_EQ(fault([](auto& p) {
              p.stimulation.watchdog = {};
            }).find("stimulation.watchdog_ms must be set"),
            0U);
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].amplitude_uA = {}; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].frequency_Hz = {}; }), "");
}

TEST(EncodingParameters, RefusesARangeThatExceedsALimit) {
  EXPECT_EQ(fault([](auto& p) { p.electrodes[0].amplitude_uA[1] = 90.0; }),
            "electrode[E1].amplitude_uA reaches 90 µA, which is 18 nC in a phase of 200 µs, above "
            "stimulation.max_charge_nC = 16: lower the amplitude or shorten stimulation.phase_us");
  EXPECT_EQ(fault([](auto& p) { p.stimulation.max_total_uA = 70.0; }),
            "electrode[E1].amplitude_uA reaches 80 µA, above stimulation.max_total_uA = 70 by "
            "itself: lower the amplitude");
  EXPECT_EQ(fault([](auto& p) { p.stimulation.max_total_uA = 80.0; }), "");
  EXPECT_EQ(fault([](auto& p) { p.electrodes[0].frequency_Hz[1] = 2500.0; }), "");
  EXPECT_EQ(fault([](auto& p) { p.electrodes[0].frequency_Hz[1] = 2600.0; }),
            "electrode[E1].frequency_Hz reaches 2600 Hz, whose period is shorter than a pulse of "
            "two phases of 200 µs: lower the frequency or shorten stimulation.phase_us");
}

TEST(EncodingParameters, AnElectrodeHasLimitsOfItsOwn) {
  EncodingParameters own = valid();
  own.stimulation.max_slope_uA_per_s = 2000.0;
  const ElectrodeLimits common = ElectrodeLimits::of(own.electrodes[0], own.stimulation);
  EXPECT_EQ(common.max_charge_nC, 16.0);
  EXPECT_EQ(common.phase, std::chrono::microseconds{200});
  EXPECT_EQ(common.max_slope_uA_per_s, 2000.0);
  EXPECT_TRUE(std::isinf(common.max_amplitude_uA));
  own.electrodes[0].phase = std::chrono::microseconds{100};
  own.electrodes[0].max_charge_nC = 8.0;
  own.electrodes[0].max_slope_uA_per_s = 500.0;
  own.electrodes[0].max_amplitude_uA = 80.0;
  own.stimulation.max_charge_nC = 0.0;  // no electrode needs it
  EXPECT_TRUE(own.check());
  EXPECT_EQ(ElectrodeLimits::of(own.electrodes[0], own.stimulation).max_slope_uA_per_s, 500.0);

  EXPECT_EQ(fault([](auto& p) { p.electrodes[0].max_charge_nC = 10.0; }),
            "electrode[E1].amplitude_uA reaches 80 µA, which is 16 nC in a phase of 200 µs, above "
            "electrode[E1].max_charge_nC = 10: lower the amplitude or shorten "
            "stimulation.phase_us");
  EXPECT_EQ(fault([](auto& p) { p.electrodes[0].phase = std::chrono::microseconds{400}; }),
            "electrode[E1].amplitude_uA reaches 80 µA, which is 32 nC in a phase of 400 µs, above "
            "stimulation.max_charge_nC = 16: lower the amplitude or shorten "
            "electrode[E1].phase_us");
  EXPECT_EQ(fault([](auto& p) { p.electrodes[0].max_amplitude_uA = 70.0; }),
            "electrode[E1].amplitude_uA reaches 80 µA, above electrode[E1].max_amplitude_uA = 70: "
            "lower the amplitude");
  EXPECT_EQ(fault([](auto& p) { p.stimulation.max_amplitude_uA = 60.0; }),
            "electrode[E1].amplitude_uA reaches 80 µA, above stimulation.max_amplitude_uA = 60: "
            "lower the amplitude");
}

TEST(EncodingParameters, RefusesInvalidValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(fault([&](auto& p) { p.electrodes[0].amplitude_uA = {nan, 80.0}; }), "");
  EXPECT_NE(fault([&](auto& p) { p.electrodes[0].amplitude_uA = {20.0, nan}; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].amplitude_uA = {80.0, 20.0}; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].amplitude_uA = {-1.0, 20.0}; }), "");
  EXPECT_EQ(fault([](auto& p) { p.electrodes[0].amplitude_uA = {80.0, 80.0}; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].amplitude_uA = {0.0, 0.0}; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].field_mm[2] = 0.0; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].window = {}; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].full_rate_Hz = 0.0; }), "");
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].name = "a,b"; }), "");
  EXPECT_TRUE(is_electrode_name("Thumb_2-a.b"));
  EXPECT_TRUE(is_electrode_name("azAZ09"));
  EXPECT_TRUE(is_electrode_name(std::string(32, 'a')));
  EXPECT_FALSE(is_electrode_name(std::string(33, 'a')));
  for (const char* other : {"`", "{", "@", "[", "/", ":"}) EXPECT_FALSE(is_electrode_name(other));
  EXPECT_FALSE(is_electrode_name(""));
  EXPECT_NE(fault([](auto& p) { p.electrodes[0].group = p.groups.size(); }), "");
  EXPECT_NE(fault([](auto& p) { p.stimulation.max_slope_uA_per_s = 0.0; }), "");
  EXPECT_NE(fault([](auto& p) { p.stimulation.max_electrodes = 0; }), "");
  EXPECT_NE(fault([](auto& p) { p.stimulation.update = {}; }), "");
  for (std::size_t electrodes = 256; electrodes <= 257; ++electrodes) {
    const std::string said = fault([=](auto& p) {
      p.electrodes.resize(electrodes, p.electrodes[0]);
      for (std::size_t e = 0; e < electrodes; ++e) p.electrodes[e].name = std::to_string(e);
    });
    EXPECT_EQ(said, electrodes == 256 ? "" : "electrode must not appear more than 256 times");
  }
  EXPECT_EQ(fault([](auto& p) { p.electrodes.push_back(p.electrodes[0]); }),
            "electrode.name \"E1\" is used by two electrodes: give each its own name");
  EXPECT_NE(fault([](auto& p) {
              p.electrodes.resize(3, p.electrodes[0]);
              p.electrodes[1].name = p.electrodes[2].name = "E2";
            }),
            "");
}

TEST(EncodingParameters, RefusesReferencesThatTheModelLacks) {
  const EncodedModel model{
      .patches = {{.area = {},
                   .afferents = {AfferentSite{.x_mm = 5.0, .y_mm = 5.0, .receptors = 1}}}},
      .patch_of_probe = {0}};
  const auto fault_with_model = [&](const std::function<void(EncodingParameters&)>& change) {
    EncodingParameters parameters = valid();
    parameters.electrodes[0].field_mm = {5.0, 5.0, 1.0};
    change(parameters);
    const auto encoder = StimulationEncoder::create(parameters, model);
    return encoder ? "" : encoder.error().key + " " + encoder.error().reason;
  };
  EXPECT_EQ(fault_with_model([](auto&) {}), "");
  const auto fault_of_watchdog = [&](std::chrono::microseconds update,
                                     std::chrono::milliseconds watchdog) {
    return fault_with_model([&](EncodingParameters& p) {
      p.stimulation.update = update;
      p.stimulation.watchdog = watchdog;
    });
  };
  using std::chrono::milliseconds;
  EXPECT_EQ(fault_of_watchdog(milliseconds{1}, milliseconds{2}), "");
  EXPECT_NE(fault_of_watchdog(std::chrono::microseconds{500}, milliseconds{1}), "");
  EXPECT_EQ(fault_with_model([](auto& p) {
              p.electrodes[0].field_mm = {15.0, 10.0, 3.0};
            }),
            "electrode[E1].field_mm contains no afferent: move it or enlarge its radius (merkel "
            "inspect afferents prints their positions)");
  EXPECT_EQ(fault_with_model([](auto& p) {
              p.electrodes[0].field_mm = {31.0, 10.0, 30.0};
            }),
            "electrode[E1].field_mm has its centre outside the patch");
  EXPECT_EQ(fault_with_model([](auto& p) {
              p.electrodes.push_back(p.electrodes[0]);
              p.electrodes[1].name = "E2";
              p.electrodes[1].field_mm = {15.0, 10.0, 3.0};
            }),
            "electrode[E2].field_mm contains no afferent: move it or enlarge its radius (merkel "
            "inspect afferents prints their positions)");
  EXPECT_EQ(fault_with_model([](auto& p) {
              p.electrodes[0].field_mm = {5.0, 21.0, 18.0};
            }),
            "electrode[E1].field_mm has its centre outside the patch");
  EXPECT_EQ(
      fault_with_model([](auto& p) { p.stimulation.update = std::chrono::microseconds{1200}; }),
      "stimulation.update_ms must be a multiple of the tick, 1 ms (loop.tick_us): the nearest is "
      "1");
  EXPECT_EQ(fault_with_model([](auto& p) { p.electrodes[0].patch = 1; }),
            "electrode[E1].patch is not a patch of the scene");
  EXPECT_EQ(
      fault_with_model([](auto& p) { p.stimulation.update = std::chrono::microseconds{2500}; }),
      "stimulation.update_ms must be a multiple of the tick, 1 ms (loop.tick_us): the nearest is "
      "3");
}

}  // namespace
TEST(EncodingParameters, OwnDrivesAreOfElectrodesThatTakeThem) {
  EncodingParameters parameters = valid();
  const auto refused = parameters.own_drive(parameters.electrodes[0].name, 0.5, 0.5);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error(), "the scene has no electrode \"" + parameters.electrodes[0].name +
                                 "\" with encoder = \"own\": set that in its [[electrode]] or "
                                 "[[electrode_group]]");
  parameters.electrodes.push_back(parameters.electrodes[0]);
  parameters.electrodes[1].name = "mine";
  parameters.electrodes[1].encoder = EncoderKind::kOwn;
  EXPECT_EQ(*parameters.own_drive("mine", 0.5, 0.25),
            (GivenDrive{.amplitude = 0.5, .frequency = 0.25, .electrode = 1}));
  for (const double none : {std::nan(""), HUGE_VAL}) {
    for (const auto& drive :
         {parameters.own_drive("mine", none, 0.5), parameters.own_drive("mine", 0.5, none)}) {
      ASSERT_FALSE(drive);
      EXPECT_EQ(drive.error(),
                "the drive of mine is not a finite number: give 0 (off) to 1 (strongest)");
    }
  }
}

}  // namespace merkel
