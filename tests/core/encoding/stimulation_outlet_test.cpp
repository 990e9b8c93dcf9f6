#include "core/encoding/stimulation_outlet.hpp"

#include <algorithm>
#include <chrono>
#include <vector>

#include <gtest/gtest.h>

#include "core/encoding/stimulation_gate.hpp"
#include "core/math/random.hpp"
#include "tests/core/encoding/tick_feed.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;

EncodingParameters outlet_parameters(double max_slope_uA_per_s = 1000.0) {
  EncodingParameters parameters =
      encoding_of({electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0),
                   electrode_at("E2", EncoderKind::kPulsePerSpike, 15.0, 10.0, 5.0)});
  if (max_slope_uA_per_s > 0.0) parameters.stimulation.max_slope_uA_per_s = max_slope_uA_per_s;
  return parameters;
}

/// An update that passed the gate at some time.
std::vector<SentCommand> sent_at(nanoseconds sent, double amplitude_uA, std::uint32_t heartbeat,
                                 Stop stop = Stop::kNone) {
  std::vector<SentCommand> update;
  for (std::uint16_t e = 0; e < 2; ++e) {
    update.push_back({.command = {.amplitude_uA = amplitude_uA,
                                  .frequency_Hz = 100.0,
                                  .heartbeat = heartbeat,
                                  .electrode = e,
                                  .stop = stop},
                      .sent = sent,
                      .valid_until = sent + milliseconds{60}});
  }
  return update;
}

std::vector<SentCommand> pulse_at(nanoseconds sent, double amplitude_uA) {
  return {{.command = {.amplitude_uA = amplitude_uA, .electrode = 1, .kind = Kind::kPulse},
           .sent = sent}};
}

TEST(StimulationOutlet, PassesOnUnchangedWhatIsOnTime) {
  StimulationOutlet outlet(outlet_parameters());
  for (std::uint32_t k = 1; k < 20; ++k) {
    const nanoseconds now = k * milliseconds{10};
    const auto update = sent_at(now - milliseconds{4}, 80.0, k);
    const auto out = outlet.pass(update, now);
    EXPECT_EQ(std::vector(out.begin(), out.end()), update);
    EXPECT_TRUE(outlet.refused().empty());
  }
}

TEST(StimulationOutlet, ALateUpdateIsNotPassedOnAndAmplitudesRiseFromTheLastOne) {
  StimulationOutlet outlet(outlet_parameters());
  outlet.pass(sent_at(milliseconds{10}, 40.0, 1), milliseconds{11});
  EXPECT_TRUE(outlet.pass(sent_at(milliseconds{20}, 80.0, 2), milliseconds{26}).empty());
  EXPECT_EQ(outlet.refused().size(), 2U);
  // The pulse of an electrode rests on the update before it.
  EXPECT_TRUE(outlet.pass(pulse_at(milliseconds{27}, 80.0), milliseconds{27}).empty());
  const auto risen = outlet.pass(sent_at(milliseconds{30}, 80.0, 3), milliseconds{31});
  ASSERT_EQ(risen.size(), 2U);
  EXPECT_DOUBLE_EQ(risen[0].command.amplitude_uA, 60.0);  // 1000 µA/s for 20 ms
  EXPECT_EQ(risen[0].command.stop, Stop::kNone);
  EXPECT_EQ(
      outlet.pass(sent_at(milliseconds{40}, 80.0, 4), milliseconds{41})[0].command.amplitude_uA,
      70.0);
  // A second one counts from what the first left.
  EXPECT_TRUE(outlet.pass(sent_at(milliseconds{50}, 80.0, 5), milliseconds{56}).empty());
  EXPECT_EQ(
      outlet.pass(sent_at(milliseconds{60}, 75.0, 6), milliseconds{61})[0].command.amplitude_uA,
      75.0);
}

TEST(StimulationOutlet, AReceiverThatHasSwitchedOffByItselfGetsAnOffFromWhichAmplitudesRise) {
  StimulationOutlet outlet(outlet_parameters());
  outlet.pass(sent_at(milliseconds{-40}, 50.0, 1), milliseconds{-40});  // valid until 20 ms
  EXPECT_TRUE(outlet.pass(sent_at(milliseconds{10}, 50.0, 2), milliseconds{26}).empty());
  EXPECT_EQ(outlet.refused().size(), 2U);
  const auto off = outlet.pass(sent_at(milliseconds{30}, 50.0, 3), milliseconds{30});
  ASSERT_EQ(off.size(), 2U);
  for (const SentCommand& each : off) {
    EXPECT_EQ(each.command.amplitude_uA, 0.0);
    EXPECT_EQ(each.command.frequency_Hz, 0.0);
    EXPECT_EQ(each.command.stop, Stop::kSinkFailure);
    EXPECT_EQ(each.command.heartbeat, 3U);
    EXPECT_EQ(each.sent, milliseconds{30});
  }
  EXPECT_EQ(outlet.refused().size(), 2U);
  for (int k = 1; k < 10; ++k) {
    const nanoseconds now = milliseconds{30 + 10 * k};
    const auto risen = outlet.pass(sent_at(now, 50.0, 3U + static_cast<unsigned>(k)), now);
    ASSERT_EQ(risen.size(), 2U);
    EXPECT_DOUBLE_EQ(risen[0].command.amplitude_uA, std::min(10.0 * k, 50.0));
    EXPECT_EQ(risen[0].command.stop, Stop::kNone);
    EXPECT_EQ(risen[0].command.frequency_Hz, 100.0);
  }
}

TEST(StimulationOutlet, AnUpdateIsValidUntilItsInstantInclusive) {
  StimulationOutlet outlet(outlet_parameters());
  outlet.pass(sent_at(milliseconds{-40}, 50.0, 1), milliseconds{-40});  // valid until 20 ms
  EXPECT_TRUE(outlet.pass(sent_at(milliseconds{10}, 50.0, 2), milliseconds{16}).empty());
  const auto last = outlet.pass(sent_at(milliseconds{19}, 50.0, 3), milliseconds{20});
  ASSERT_EQ(last.size(), 2U);
  EXPECT_EQ(last[0].command.amplitude_uA, 50.0);
}

TEST(StimulationOutlet, APulseBelowAMicroamperePasses) {
  StimulationOutlet outlet(outlet_parameters());
  outlet.pass(sent_at(milliseconds{10}, 0.0, 1), milliseconds{10});
  EXPECT_EQ(outlet.pass(pulse_at(milliseconds{12}, 0.5), milliseconds{12}).size(), 1U);
}

TEST(StimulationOutlet, APartWithoutItsBeginIsRefusedOnce) {
  StimulationOutlet outlet(outlet_parameters());
  auto update = sent_at(milliseconds{10}, 50.0, 1);
  EXPECT_TRUE(outlet.pass({update.begin() + 1, update.end()}, milliseconds{10}).empty());
  EXPECT_EQ(outlet.refused().size(), 1U);
  update = sent_at(milliseconds{20}, 50.0, 2);
  EXPECT_EQ(outlet.pass(update, milliseconds{20}).size(), 2U);
  EXPECT_EQ(outlet.refused().size(), 2U);  // it has to begin with an off
}

TEST(StimulationOutlet, WhatIsRefusedIsSaidBelowAMicroampereToo) {
  StimulationOutlet outlet(outlet_parameters());
  outlet.lose();
  outlet.pass(sent_at(milliseconds{10}, 0.5, 1), milliseconds{10});
  EXPECT_EQ(outlet.refused().size(), 2U);
}

TEST(StimulationOutlet, FiveMillisecondsAreOnTime) {
  StimulationOutlet outlet(outlet_parameters());
  const nanoseconds sent = milliseconds{10};
  EXPECT_EQ(outlet.pass(sent_at(sent, 50.0, 1), sent + StimulationOutlet::kPatience).size(), 2U);
  EXPECT_EQ(outlet.pass(pulse_at(sent, 50.0), sent + StimulationOutlet::kPatience).size(), 1U);
}

TEST(StimulationOutlet, AnUpdateAtTheInstantOfTheOffIsOffToo) {
  StimulationOutlet outlet(outlet_parameters());
  outlet.lose();
  auto both = sent_at(milliseconds{10}, 50.0, 1);
  const auto second = sent_at(milliseconds{11}, 50.0, 2);
  both.insert(both.end(), second.begin(), second.end());
  const auto out = outlet.pass(both, milliseconds{11});
  ASSERT_EQ(out.size(), 4U);
  EXPECT_EQ(out[2].command.heartbeat, 2U);
  EXPECT_EQ(out[2].command.amplitude_uA, 0.0);
  EXPECT_EQ(out[2].command.frequency_Hz, 0.0);
}

TEST(StimulationOutlet, ALateStopStillLeaves) {
  StimulationOutlet outlet(outlet_parameters());
  const auto stop = sent_at(milliseconds{20}, 0.0, 1, Stop::kStale);
  EXPECT_EQ(outlet.pass(stop, milliseconds{80}).size(), 2U);
  EXPECT_TRUE(outlet.refused().empty());
  // The reason of a stop that is on time stays, too.
  const auto kept =
      outlet.pass(sent_at(milliseconds{90}, 0.0, 2, Stop::kReleased), milliseconds{90});
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].command.stop, Stop::kReleased);
}

TEST(StimulationOutlet, AnAmplitudeBelowOneMicroampereKeepsItsFrequency) {
  StimulationOutlet outlet(outlet_parameters(10.0));
  outlet.lose();
  EXPECT_EQ(outlet.pass(sent_at(milliseconds{10}, 50.0, 1), milliseconds{10}).size(), 2U);
  const auto risen = outlet.pass(sent_at(milliseconds{60}, 50.0, 2), milliseconds{60});
  ASSERT_EQ(risen.size(), 2U);
  EXPECT_DOUBLE_EQ(risen[0].command.amplitude_uA, 0.5);
  EXPECT_EQ(risen[0].command.frequency_Hz, 100.0);
}

TEST(StimulationOutlet, AReceiverThatWasAwayGetsAnOffFirstAlsoIfNothingIsLate) {
  StimulationOutlet outlet(outlet_parameters(0.0));
  outlet.pass(sent_at(milliseconds{10}, 50.0, 1), milliseconds{10});
  outlet.lose();
  EXPECT_TRUE(outlet.pass(pulse_at(milliseconds{12}, 80.0), milliseconds{12}).empty());
  EXPECT_EQ(outlet.refused().size(), 1U);
  EXPECT_EQ(
      outlet.pass(sent_at(milliseconds{20}, 50.0, 2), milliseconds{20})[0].command.amplitude_uA,
      0.0);
  // Without a slope it goes on at once.
  EXPECT_EQ(
      outlet.pass(sent_at(milliseconds{30}, 50.0, 3), milliseconds{30})[0].command.amplitude_uA,
      50.0);
}

TEST(StimulationOutlet, PulsesRiseFromTheOffToo) {
  StimulationOutlet outlet(outlet_parameters());
  EXPECT_EQ(outlet.pass(pulse_at(milliseconds{5}, 80.0), milliseconds{6})[0].command.amplitude_uA,
            80.0);
  EXPECT_TRUE(outlet.pass(pulse_at(milliseconds{10}, 80.0), milliseconds{16}).empty());
  EXPECT_EQ(outlet.pass(sent_at(milliseconds{20}, 0.0, 2), milliseconds{20})[0].command.stop,
            Stop::kSinkFailure);
  EXPECT_TRUE(outlet.refused().empty());  // it had nothing to refuse
  EXPECT_TRUE(outlet.pass(pulse_at(milliseconds{20}, 80.0), milliseconds{20}).empty());  // 0 µA
  const auto pulse = outlet.pass(pulse_at(milliseconds{25}, 80.0), milliseconds{25});
  ASSERT_EQ(pulse.size(), 1U);
  EXPECT_DOUBLE_EQ(pulse[0].command.amplitude_uA, 5.0);
}

TEST(StimulationOutlet, AnUpdateIsPassedOnWhole) {
  StimulationOutlet outlet(outlet_parameters());
  const auto update = sent_at(milliseconds{20}, 50.0, 1);
  EXPECT_TRUE(outlet.pass(std::span(update).first(1), milliseconds{20}).empty());
  EXPECT_EQ(outlet.pass(std::span(update).subspan(1), milliseconds{21}).size(), 2U);
  // A part is lost: the rest is no update, and the next one is an off.
  const auto second = sent_at(milliseconds{30}, 50.0, 2);
  EXPECT_TRUE(outlet.pass(std::span(second).subspan(1), milliseconds{30}).empty());
  EXPECT_EQ(outlet.refused().size(), 1U);
  const auto third = sent_at(milliseconds{40}, 50.0, 3);
  EXPECT_TRUE(outlet.pass(std::span(third).first(1), milliseconds{40}).empty());
  const auto off = outlet.pass(sent_at(milliseconds{50}, 50.0, 4), milliseconds{50});
  ASSERT_EQ(off.size(), 2U);
  EXPECT_EQ(off[1].command.heartbeat, 4U);
  EXPECT_EQ(off[1].command.stop, Stop::kSinkFailure);
}

TEST(StimulationOutlet, AnUpdateWhoseEndIsLostIsReportedAndFollowedByAnOff) {
  StimulationOutlet outlet(outlet_parameters());
  outlet.pass(sent_at(milliseconds{10}, 40.0, 1), milliseconds{11});
  auto cut = sent_at(milliseconds{20}, 0.0, 2, Stop::kGap);
  cut.pop_back();
  EXPECT_TRUE(outlet.pass(cut, milliseconds{21}).empty());
  EXPECT_TRUE(outlet.refused().empty()) << "its end may come";
  const auto out = outlet.pass(sent_at(milliseconds{30}, 40.0, 3), milliseconds{31});
  ASSERT_EQ(out.size(), 2U);
  for (const SentCommand& each : out) EXPECT_EQ(each.command.stop, Stop::kSinkFailure);
  ASSERT_EQ(outlet.refused().size(), 3U);  // the cut update, and what the off replaces
  EXPECT_EQ(outlet.refused()[0], cut[0]);
}

TEST(StimulationOutlet, ALateStopOfOneElectrodeIsAnOffForAll) {
  for (const std::size_t stopped : {0U, 1U}) {
    StimulationOutlet outlet(outlet_parameters());
    outlet.pass(sent_at(milliseconds{10}, 50.0, 1), milliseconds{10});
    auto update = sent_at(milliseconds{20}, 60.0, 2);
    update[stopped].command.stop = Stop::kReleased;
    update[stopped].command.amplitude_uA = 0.0;
    const auto off = outlet.pass(update, milliseconds{26});
    ASSERT_EQ(off.size(), 2U);
    EXPECT_EQ(off[stopped].command.stop, Stop::kReleased);
    EXPECT_EQ(off[1 - stopped].command.stop, Stop::kSinkFailure);
    EXPECT_EQ(off[1 - stopped].command.amplitude_uA, 0.0);
    EXPECT_EQ(outlet.refused().size(), 1U);
    const auto risen = outlet.pass(sent_at(milliseconds{30}, 60.0, 3), milliseconds{30});
    EXPECT_DOUBLE_EQ(risen[1 - stopped].command.amplitude_uA, 4.0);
  }
}

TEST(StimulationOutlet, WhatItLowersIsOnTheStepsOfTheStimulator) {
  EncodingParameters parameters = outlet_parameters(250.0);
  parameters.stimulator.name = "box";
  parameters.stimulator.min_amplitude_uA = 1.0;
  parameters.stimulator.amplitude_step_uA = 1.0;
  StimulationOutlet outlet(parameters);
  outlet.lose();
  outlet.pass(sent_at(milliseconds{10}, 50.0, 1), milliseconds{10});
  const auto weak = outlet.pass(sent_at(milliseconds{13}, 50.0, 2), milliseconds{13});
  EXPECT_EQ(weak[0].command.amplitude_uA, 0.0);  // 0.75 µA
  EXPECT_EQ(weak[0].command.frequency_Hz, 0.0);
  EXPECT_EQ(
      outlet.pass(sent_at(milliseconds{20}, 50.0, 3), milliseconds{20})[1].command.amplitude_uA,
      2.0);  // 2.5 µA
}

TEST(StimulationOutlet, NeverIncreasesAnAmplitudeNorRisesAboveTheSlopeWhateverIsLost) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    StimulationOutlet outlet(outlet_parameters());
    double gate_uA = 0.0;
    double last_uA = 0.0;
    nanoseconds last{0};
    bool missed = false;
    std::uint32_t heartbeat = 0;
    for (int k = 1; k < 500; ++k) {
      const nanoseconds sent = k * milliseconds{10};
      gate_uA = std::clamp(gate_uA + random.uniform(-30.0, 10.0), 0.0, 80.0);
      const bool late = random.uniform() < 0.1;
      if (random.uniform() < 0.05) {
        outlet.lose();
        missed = true;
      }
      const nanoseconds now = sent + (late ? milliseconds{8} : milliseconds{1});
      const auto out = outlet.pass(sent_at(sent, gate_uA, ++heartbeat), now);
      if (out.empty()) continue;
      const double amplitude_uA = out[0].command.amplitude_uA;
      if (missed) {
        EXPECT_EQ(amplitude_uA, 0.0) << seed;  // an off before anything else
        missed = false;
      }
      EXPECT_LE(amplitude_uA, gate_uA);
      const double elapsed_s = std::chrono::duration<double>(now - last).count();
      EXPECT_LE(amplitude_uA, last_uA + 1000.0 * elapsed_s + 1e-9) << seed;
      last_uA = amplitude_uA;
      last = now;
    }
  }
}

}  // namespace
}  // namespace merkel
