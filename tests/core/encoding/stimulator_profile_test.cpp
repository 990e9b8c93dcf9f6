#include "core/encoding/stimulator_profile.hpp"

#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "tests/core/encoding/tick_feed.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;

/// Electrodes for a stimulator of whole microamperes and hertz.
EncodingParameters stimulated(int electrodes) {
  EncodingParameters parameters = encoding_of({});
  for (int e = 0; e < electrodes; ++e) {
    parameters.electrodes.push_back(
        electrode_at("E" + std::to_string(e + 1), EncoderKind::kRate, 15.0, 10.0, 3.0));
  }
  parameters.stimulation.interphase = microseconds{53};
  parameters.stimulator = {.name = "box",
                           .min_amplitude_uA = 1.0,
                           .max_amplitude_uA = 215.0,
                           .amplitude_step_uA = 1.0,
                           .min_frequency_Hz = 4.0,
                           .max_frequency_Hz = 5000.0,
                           .frequency_step_Hz = 1.0,
                           .min_phase = microseconds{44},
                           .max_phase = microseconds{65535},
                           .min_interphase = microseconds{53},
                           .max_interphase = microseconds{65535},
                           .time_step = microseconds{1}};
  return parameters;
}

StimulationCommand train(double amplitude_uA, double frequency_Hz, std::uint16_t electrode = 0) {
  return {.amplitude_uA = amplitude_uA, .frequency_Hz = frequency_Hz, .electrode = electrode};
}

std::pair<double, double> rounded(const EncodingParameters& parameters, double amplitude_uA,
                                  double frequency_Hz, Kind kind = Kind::kUpdate) {
  StimulatorSteps steps(parameters);
  StimulationCommand command = train(amplitude_uA, frequency_Hz);
  command.kind = kind;
  steps.round_down({&command, 1});
  return {command.amplitude_uA, command.frequency_Hz};
}

TEST(StimulatorProfile, RoundsDownAndNeverUp) {
  const EncodingParameters box = stimulated(1);
  EXPECT_EQ(rounded(box, 20.9, 99.9), std::pair(20.0, 99.0));
  EXPECT_EQ(rounded(box, 20.0, 99.0), std::pair(20.0, 99.0));
  EXPECT_EQ(rounded(box, 0.9, 99.0), std::pair(0.0, 0.0));
  EXPECT_EQ(rounded(box, 20.0, 3.9), std::pair(0.0, 0.0));  // not 4 Hz, which is more
  EXPECT_EQ(rounded(box, 20.0, 4.0), std::pair(20.0, 4.0));
  EXPECT_EQ(rounded(box, 0.0, 0.0), std::pair(0.0, 0.0));
  EXPECT_EQ(rounded(box, 20.9, 0.0, Kind::kPulse), std::pair(20.0, 0.0));
  EXPECT_EQ(rounded(stimulated(1), 1.0, 4.0), std::pair(1.0, 4.0));
  EncodingParameters none = box;
  none.stimulator.name.clear();
  EXPECT_EQ(rounded(none, 20.9, 99.9), std::pair(20.9, 99.9));
}

TEST(StimulatorProfile, RoundingTwiceChangesNothingMore) {
  EncodingParameters tenths = stimulated(1);
  tenths.stimulator.amplitude_step_uA = 0.1;
  Random random(1);
  for (int k = 0; k < 10000; ++k) {
    const double value = random.uniform(1.2, 215.0);
    const auto once = rounded(tenths, value, 50.0);
    ASSERT_LE(once.first, value);
    ASSERT_GT(once.first, value - 0.1000001);
    ASSERT_EQ(rounded(tenths, once.first, 50.0), once);
  }
}

TEST(StimulatorProfile, KeepsTheCurrentOfALongerSecondPhaseOnAStep) {
  EncodingParameters box = stimulated(1);
  box.stimulation.second_phase = microseconds{300};  // 2/3 of the current
  EXPECT_EQ(rounded(box, 20.9, 99.0), std::pair(18.0, 99.0));
  EXPECT_EQ(rounded(box, 21.0, 99.0), std::pair(21.0, 99.0));
}

TEST(StimulatorProfile, HoldsNoMoreWaveformsThanTheStimulator) {
  EncodingParameters box = stimulated(40);
  box.stimulator.waveforms = 15;
  StimulatorSteps steps(box);
  Random random(2);
  for (int k = 0; k < 500; ++k) {
    std::vector<StimulationCommand> update;
    for (std::uint16_t e = 0; e < 40; ++e) {
      update.push_back(train(random.uniform(0.0, 80.0), random.uniform(0.0, 200.0), e));
    }
    const auto before = update;
    steps.round_down(update);
    std::set<std::pair<double, double>> waveforms;
    for (std::size_t e = 0; e < update.size(); ++e) {
      ASSERT_LE(update[e].amplitude_uA, before[e].amplitude_uA);
      ASSERT_LE(update[e].frequency_Hz, before[e].frequency_Hz);
      if (update[e].amplitude_uA > 0.0) {
        waveforms.emplace(update[e].amplitude_uA, update[e].frequency_Hz);
      }
    }
    ASSERT_LE(waveforms.size(), 15U);
    ASSERT_GE(waveforms.size(), 2U);
  }
}

TEST(StimulatorProfile, PhasesOfDifferentLengthAreDifferentWaveforms) {
  EncodingParameters box = stimulated(2);
  box.electrodes[1].phase = microseconds{100};
  box.stimulator.waveforms = 1;
  StimulatorSteps steps(box);
  std::vector update = {train(9.0, 100.0, 0), train(9.0, 100.0, 1)};
  steps.round_down(update);
  EXPECT_EQ(update[0].amplitude_uA, 0.0);
  EXPECT_EQ(update[1].amplitude_uA, 0.0);
  box.electrodes[1].phase.reset();
  StimulatorSteps same(box);
  update = {train(9.0, 100.0, 0), train(9.0, 100.0, 1)};
  same.round_down(update);
  EXPECT_EQ(update[1].amplitude_uA, 9.0);
}

TEST(StimulatorProfile, DoublesItsStepsUntilTheWaveformsSuffice) {
  EncodingParameters box = stimulated(2);
  box.stimulator.waveforms = 1;
  StimulatorSteps steps(box);
  std::vector update = {train(5.0, 100.0, 0), train(6.0, 100.0, 1)};
  steps.round_down(update);
  EXPECT_EQ(update[0].amplitude_uA, 4.0);
  EXPECT_EQ(update[1].amplitude_uA, 4.0);
  update = {train(1.0, 100.0, 0), train(1.0, 101.0, 1)};
  steps.round_down(update);
  EXPECT_EQ(update[0].amplitude_uA, 0.0);
  EXPECT_EQ(update[1].amplitude_uA, 0.0);
}

TEST(StimulatorProfile, ALowFrequencyIsKeptWhereTheStimulatorHasIt) {
  EncodingParameters box = stimulated(1);
  box.stimulator.min_frequency_Hz = box.stimulator.frequency_step_Hz = 0.0;
  EXPECT_EQ(rounded(box, 20.0, 0.5), std::pair(20.0, 0.5));
  EXPECT_EQ(rounded(box, 20.0, 0.0), std::pair(0.0, 0.0));
  box.stimulator.min_amplitude_uA = box.stimulator.amplitude_step_uA = 0.0;
  EXPECT_EQ(rounded(box, 0.0, 50.0), std::pair(0.0, 0.0));
}

TEST(StimulatorProfile, CountsWhatRoundingTakesAway) {
  StimulatorSteps steps(stimulated(2));
  std::vector update = {train(20.75, 99.5, 0), train(30.0, 50.0, 1)};
  steps.round_down(update);
  update = {train(20.25, 99.25, 0), train(0.0, 0.0, 1)};
  steps.round_down(update);
  EXPECT_EQ(steps.counts().rounded, 2U);
  EXPECT_EQ(steps.counts().largest_uA, 0.75);
  EXPECT_EQ(steps.counts().largest_Hz, 0.5);
}

TEST(StimulatorProfile, RefusesScenesThatTheStimulatorCannotGive) {
  const auto refusal = [](const std::function<void(EncodingParameters&)>& change) {
    EncodingParameters parameters = stimulated(1);
    change(parameters);
    const auto checked = parameters.check();
    return checked ? "" : checked.error().key + " " + checked.error().reason;
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& p) { p.stimulation.interphase = microseconds{52}; }),
            "stimulation.interphase_us must be one that the stimulator box has: 53 to 65535 µs in "
            "steps of 1");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.max_interphase = microseconds{53}; }), "");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.max_frequency_Hz = 200.0; }), "");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.max_amplitude_uA = 80.0; }), "");
  EXPECT_EQ(refusal([](auto& p) {
              p.stimulator.name.clear();
              p.stimulator.max_amplitude_uA = 79.0;
            }),
            "");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.asymmetric = false; }), "");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.anodic_first = false; }), "");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.waveforms = 15; }), "");
  EXPECT_TRUE(refusal([](auto& p) {
                p.stimulator.max_amplitude_uA = -1.0;
              }).starts_with("stimulator.max_amplitude_uA"));
  EXPECT_EQ(refusal([](auto& p) {
              p.stimulation.interphase = microseconds{52};
              p.stimulator.time_step = {};
            }),
            "stimulation.interphase_us must be one that the stimulator box has: 53 to 65535 µs");
  EXPECT_EQ(refusal([](auto& p) {
              p.stimulation.second_phase = microseconds{400};
              p.stimulator.max_phase = microseconds{300};
            }),
            "stimulation.second_phase_us must be one that the stimulator box has: 44 to 300 µs in "
            "steps of 1");
  EXPECT_NE(refusal([](auto& p) { p.stimulation.phase = nanoseconds{200'500}; }), "");
  EXPECT_EQ(refusal([](auto& p) { p.electrodes[0].phase = microseconds{43}; }),
            "electrode[E1].phase_us must be one that the stimulator box has: 44 to 65535 µs in "
            "steps of 1");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.max_amplitude_uA = 79.0; }),
            "electrode[E1].amplitude_uA reaches 80 µA, but the stimulator box ends at 79: lower "
            "the amplitude");
  EXPECT_EQ(refusal([](auto& p) { p.stimulator.max_frequency_Hz = 199.0; }),
            "electrode[E1].frequency_Hz reaches 200 Hz, but the stimulator box ends at 199: lower "
            "the frequency");
  EXPECT_EQ(refusal([](auto& p) {
              p.stimulation.second_phase = microseconds{400};
              p.stimulator.asymmetric = false;
            }),
            "stimulation.second_phase_us must be the phase of E1, because the stimulator box has "
            "equal phases only: remove it");
  EXPECT_EQ(refusal([](auto& p) {
              p.stimulation.polarity = Polarity::kAnodicFirst;
              p.stimulator.anodic_first = false;
            }),
            "stimulation.polarity must be one that the stimulator box has: cathodic_first");
  EXPECT_NE(refusal([](auto& p) {
              p.stimulator.waveforms = 15;
              p.stimulator.amplitude_step_uA = 0.0;
            }),
            "");
  EXPECT_NE(refusal([](auto& p) { p.stimulation.second_phase = microseconds{100}; }), "");
}

}  // namespace
}  // namespace merkel
