#include "core/encoding/stimulation_gate.hpp"

#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/math/random.hpp"
#include "tests/core/encoding/tick_feed.hpp"
#include "tests/core/encoding/wall_auditor.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;
using Moment = StimulationGate::Moment;

constexpr milliseconds kWatchdog{60};

EncodingParameters two_electrodes(double max_slope_uA_per_s) {
  auto linear = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0);
  linear.full_force_N = 0.5;
  auto pulses = electrode_at("E2", EncoderKind::kPulsePerSpike, 15.0, 10.0, 5.0);
  EncodingParameters parameters = encoding_of({linear, pulses});
  parameters.stimulation.watchdog = kWatchdog;
  if (max_slope_uA_per_s > 0.0) parameters.stimulation.max_slope_uA_per_s = max_slope_uA_per_s;
  return parameters;
}

/// An update of one electrode.
std::vector<StimulationCommand> update_at(nanoseconds time, double amplitude_uA,
                                          Stop stop = Stop::kNone) {
  return {{.time = time, .amplitude_uA = amplitude_uA, .frequency_Hz = 100.0, .stop = stop}};
}

/// A gate of one electrode, and the clock of its sink.
class OneElectrode {
 public:
  explicit OneElectrode(double max_slope_uA_per_s = 0.0)
      : gate_(parameters(max_slope_uA_per_s), kTick) {}

  /// \param age  of the command when it leaves
  std::vector<StimulationCommand> pass(nanoseconds now, double amplitude_uA,
                                       nanoseconds age = milliseconds{3}) {
    return passed(now, update_at(now - age, amplitude_uA));
  }
  std::vector<StimulationCommand> passed(nanoseconds now,
                                         const std::vector<StimulationCommand>& commands,
                                         std::optional<nanoseconds> last_tick = {},
                                         std::optional<nanoseconds> newest = {},
                                         nanoseconds wall_offset = {}) {
    const nanoseconds newest_sample = newest.value_or(now);
    const auto leaving = gate_.pass(commands, {.now = now,
                                               .wall_offset = wall_offset,
                                               .delay = milliseconds{3},
                                               .last_tick = last_tick.value_or(now),
                                               .newest = {&newest_sample, 1},
                                               .stopped = stopped_,
                                               .stops = stops_});
    return commands_of(leaving);
  }
  void stop() {
    stopped_ = true;
    ++stops_;
  }
  void start() { stopped_ = false; }
  void jump() { gate_.jump(); }
  [[nodiscard]] const StimulationGate& gate() const { return gate_; }

 private:
  static EncodingParameters parameters(double max_slope_uA_per_s) {
    EncodingParameters all = two_electrodes(max_slope_uA_per_s);
    all.electrodes.pop_back();
    return all;
  }
  StimulationGate gate_;
  bool stopped_ = false;  ///< by hand
  std::uint16_t stops_ = 0;
};

TEST(StimulationGate, PassesCommandsThatAreOnTime) {
  OneElectrode output;
  for (int k = 1; k <= 3; ++k) {
    const auto leaving = output.pass(k * milliseconds{10}, 20.0 * k);
    ASSERT_EQ(leaving.size(), 1U);
    EXPECT_EQ(leaving[0].amplitude_uA, 20.0 * k);
    EXPECT_EQ(leaving[0].frequency_Hz, 100.0);
    EXPECT_EQ(leaving[0].heartbeat, static_cast<std::uint32_t>(k));
  }
  EXPECT_EQ(output.gate().counts().withheld, 0U);
}

TEST(StimulationGate, EachCommandSaysWhenItLeftAndUntilWhenItIsValid) {
  StimulationGate gate(two_electrodes(0.0), kTick);
  const std::vector<StimulationCommand> update = {
      {.time = milliseconds{100}, .amplitude_uA = 30.0, .frequency_Hz = 50.0},
      {.time = milliseconds{100}, .electrode = 1},
      {.time = milliseconds{101}, .amplitude_uA = 40.0, .electrode = 1, .kind = Kind::kPulse}};
  const auto sent = gate.pass(
      update, {.now = milliseconds{104}, .delay = milliseconds{3}, .last_tick = milliseconds{104}});
  ASSERT_EQ(sent.size(), 3U);
  for (const SentCommand& each : sent) {
    EXPECT_EQ(each.sent, milliseconds{104});
    EXPECT_EQ(each.valid_until, milliseconds{104} + kWatchdog);
    EXPECT_EQ(each.refused_by, 0U);
  }
}

TEST(StimulationGate, WithholdsABacklog) {
  OneElectrode output;
  const milliseconds start{2000};
  for (int k = 0; k < 100; ++k) {
    const nanoseconds time = milliseconds{1000} + k * milliseconds{10};
    const auto leaving = output.passed(start, update_at(time, 50.0));
    EXPECT_EQ(leaving.size(), start - time <= milliseconds{10} ? 1U : 0U) << k;
  }
  EXPECT_EQ(output.gate().counts().withheld, 99U);
}

TEST(StimulationGate, AnAmplitudeRisesWithTheSlopeInWallTime) {
  OneElectrode output(1000.0);
  EXPECT_EQ(output.pass(milliseconds{1000}, 80.0)[0].amplitude_uA, 12.0);  // one update, two ticks
  // Two updates of 10 ms of probe time leave within 2 ms.
  EXPECT_DOUBLE_EQ(output.pass(milliseconds{1001}, 80.0)[0].amplitude_uA, 13.0);
  EXPECT_DOUBLE_EQ(output.pass(milliseconds{1002}, 80.0)[0].amplitude_uA, 14.0);
  EXPECT_EQ(output.pass(milliseconds{1003}, 5.0)[0].amplitude_uA, 5.0);
  EXPECT_EQ(output.gate().counts().slowed, 3U);
}

TEST(StimulationGate, AfterAJumpBackCommandsLeaveAndRiseFromZero) {
  OneElectrode output(1000.0);
  nanoseconds now{milliseconds{5000}};
  for (int k = 0; k < 20; ++k) output.pass(now += milliseconds{10}, 50.0);
  output.passed(now, update_at(now, 0.0, Stop::kGap));
  // A recording goes on from an earlier place.
  now += milliseconds{10};
  const auto played = [&](nanoseconds place) {
    return output.passed(now, update_at(place, 50.0), {}, {}, now - place);
  };
  EXPECT_TRUE(played(milliseconds{700}).empty());
  output.jump();
  EXPECT_EQ(played(milliseconds{700})[0].amplitude_uA, 10.0);
  now += milliseconds{10};
  EXPECT_EQ(played(milliseconds{710})[0].amplitude_uA, 20.0);
}

TEST(StimulationGate, SwitchesOffWhenTheLoopHangsAndRisesFromZeroAfterwards) {
  OneElectrode output(1000.0);
  nanoseconds now{0};
  for (int k = 0; k < 20; ++k) output.pass(now += milliseconds{10}, 50.0);
  const nanoseconds last_tick = now;
  for (int k = 0; k < 60; ++k) {
    EXPECT_TRUE(output.passed(now += milliseconds{1}, {}, last_tick).empty()) << k;
  }
  const auto off = output.passed(now += milliseconds{1}, {}, last_tick);
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].amplitude_uA, 0.0);
  EXPECT_EQ(off[0].frequency_Hz, 0.0);
  EXPECT_EQ(off[0].stop, Stop::kStale);
  EXPECT_EQ(off[0].heartbeat, 21U);
  for (int k = 0; k < 2000; ++k) {
    EXPECT_TRUE(output.passed(now += milliseconds{1}, {}, last_tick).empty());
  }
  const auto risen = output.pass(now += milliseconds{1}, 50.0);
  ASSERT_EQ(risen.size(), 1U);
  EXPECT_EQ(risen[0].amplitude_uA, 12.0);
  EXPECT_EQ(risen[0].stop, Stop::kNone);
  EXPECT_EQ(output.gate().counts().stale, 1U);
}

TEST(StimulationGate, SwitchesOffWhenTheNewestSampleIsOld) {
  OneElectrode output;
  output.pass(milliseconds{100}, 50.0);
  const auto at = [&](milliseconds now) {
    return output.passed(now, update_at(now - milliseconds{3}, 50.0), {}, milliseconds{100});
  };
  EXPECT_EQ(at(milliseconds{150}).back().amplitude_uA, 50.0);
  EXPECT_EQ(at(milliseconds{160}).back().amplitude_uA, 50.0);
  const auto off = at(milliseconds{161});
  ASSERT_FALSE(off.empty());
  for (const auto& command : off) {
    EXPECT_EQ(command.amplitude_uA, 0.0);
    EXPECT_EQ(command.stop, Stop::kStale);
  }
  // Heartbeats continue while the loop runs, and with new samples the electrode comes back.
  EXPECT_EQ(at(milliseconds{171}).back().stop, Stop::kStale);
  EXPECT_EQ(output.pass(milliseconds{181}, 50.0).back().amplitude_uA, 50.0);
}

TEST(StimulationGate, SwitchesOffFirstAfterItsOwnThreadWasStopped) {
  OneElectrode output;
  output.pass(milliseconds{100}, 50.0);
  const auto after = output.pass(milliseconds{900}, 50.0);
  ASSERT_EQ(after.size(), 2U);
  EXPECT_EQ(after[0].stop, Stop::kStale);
  EXPECT_EQ(after[0].amplitude_uA, 0.0);
  EXPECT_EQ(after[1].amplitude_uA, 50.0);
}

TEST(StimulationGate, AStopByHandSwitchesOffAtOnceAndHoldsUntilItIsLifted) {
  OneElectrode output(1000.0);
  nanoseconds now{milliseconds{1000}};
  for (int k = 0; k < 10; ++k) output.pass(now += milliseconds{10}, 50.0);
  output.stop();
  // Without a command of the encoder, and although the loop goes on.
  const auto off = output.passed(now += milliseconds{1}, {});
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].stop, Stop::kStopped);
  EXPECT_EQ(off[0].amplitude_uA, 0.0);
  EXPECT_EQ(off[0].frequency_Hz, 0.0);
  EXPECT_TRUE(output.passed(now += milliseconds{1}, {}).empty());
  for (int k = 0; k < 10; ++k) {
    const auto held = output.pass(now += milliseconds{10}, 50.0);
    ASSERT_EQ(held.size(), 1U);
    EXPECT_EQ(held[0].stop, Stop::kStopped);
    EXPECT_EQ(held[0].amplitude_uA, 0.0);
  }
  EXPECT_EQ(output.gate().counts().stale, 0U);
  output.start();
  EXPECT_EQ(output.pass(now += milliseconds{10}, 50.0)[0].amplitude_uA, 10.0);
  EXPECT_EQ(output.pass(now += milliseconds{10}, 50.0)[0].stop, Stop::kNone);
}

TEST(StimulationGate, AStopByHandThatIsOverWhenTheGateAsksSwitchesOffToo) {
  OneElectrode output(1000.0);
  nanoseconds now{milliseconds{1000}};
  for (int k = 0; k < 10; ++k) output.pass(now += milliseconds{10}, 50.0);
  output.stop();
  output.start();
  const auto off = output.passed(now += milliseconds{1}, {});
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].stop, Stop::kStopped);
  EXPECT_EQ(off[0].amplitude_uA, 0.0);
  const auto risen = output.pass(now += milliseconds{10}, 50.0);
  EXPECT_EQ(risen[0].amplitude_uA, 10.0);
  EXPECT_EQ(risen[0].stop, Stop::kNone);
}

TEST(StimulationGate, AStopByHandHoldsFromTheFirstUpdateAndTheEndStaysTheEnd) {
  OneElectrode output;
  output.stop();
  EXPECT_EQ(output.pass(milliseconds{100}, 50.0)[0].stop, Stop::kStopped);
  const auto last = output.passed(milliseconds{110}, update_at(milliseconds{108}, 0.0, Stop::kEnd));
  EXPECT_EQ(last[0].stop, Stop::kEnd);
  output.start();
  EXPECT_TRUE(output.passed(milliseconds{111}, {}).empty());
  output.stop();
  EXPECT_TRUE(output.passed(milliseconds{112}, {}).empty());
}

TEST(StimulationGate, ALateStopStillLeaves) {
  OneElectrode output;
  output.pass(milliseconds{100}, 50.0);
  const auto stop =
      output.passed(milliseconds{150}, update_at(milliseconds{110}, 0.0, Stop::kReleased));
  ASSERT_EQ(stop.size(), 1U);
  EXPECT_EQ(stop[0].stop, Stop::kReleased);
  EXPECT_EQ(stop[0].amplitude_uA, 0.0);
}

TEST(StimulationGate, TheTimesOfWhatLeavesNeverGoBack) {
  OneElectrode output;
  const auto first = output.pass(milliseconds{100}, 50.0);
  ASSERT_EQ(first.size(), 1U);
  const auto stop =
      output.passed(milliseconds{101}, update_at(milliseconds{90}, 0.0, Stop::kReleased));
  ASSERT_EQ(stop.size(), 1U);
  EXPECT_EQ(stop[0].stop, Stop::kReleased);
  EXPECT_EQ(stop[0].time, first[0].time);
}

/// A gate of two electrodes on one patch.
class TwoElectrodes {
 public:
  explicit TwoElectrodes(const EncodingParameters& parameters) : gate_(parameters, kTick) {}

  std::vector<StimulationCommand> pass(nanoseconds now, std::vector<StimulationCommand> commands,
                                       std::optional<nanoseconds> newest = {}) {
    const nanoseconds newest_sample = newest.value_or(now);
    const auto leaving = gate_.pass(
        commands,
        {.now = now, .delay = milliseconds{3}, .last_tick = now, .newest = {&newest_sample, 1}});
    return commands_of(leaving);
  }
  static std::vector<StimulationCommand> update(nanoseconds time, double first_uA, double first_Hz,
                                                double second_uA, double second_Hz,
                                                Stop of_first = Stop::kNone) {
    return {{.time = time, .amplitude_uA = first_uA, .frequency_Hz = first_Hz, .stop = of_first},
            {.time = time, .amplitude_uA = second_uA, .frequency_Hz = second_Hz, .electrode = 1}};
  }
  static StimulationCommand pulse(nanoseconds time, double amplitude_uA) {
    return {.time = time, .amplitude_uA = amplitude_uA, .electrode = 1, .kind = Kind::kPulse};
  }
  void jump() { gate_.jump(); }

 private:
  StimulationGate gate_;
};

TEST(StimulationGate, ALateStopRaisesNoOtherElectrode) {
  TwoElectrodes output(two_electrodes(0.0));
  output.pass(milliseconds{100}, output.update(milliseconds{98}, 10.0, 50.0, 30.0, 60.0));
  const auto higher = output.pass(
      milliseconds{150}, output.update(milliseconds{110}, 0.0, 0.0, 70.0, 200.0, Stop::kReleased));
  ASSERT_EQ(higher.size(), 2U);
  EXPECT_EQ(higher[0].stop, Stop::kReleased);
  EXPECT_EQ(higher[1].amplitude_uA, 30.0);
  EXPECT_EQ(higher[1].frequency_Hz, 60.0);
  // It may lower it.
  const auto lower = output.pass(
      milliseconds{170}, output.update(milliseconds{130}, 0.0, 0.0, 20.0, 40.0, Stop::kReleased));
  ASSERT_EQ(lower.size(), 2U);
  EXPECT_EQ(lower[1].amplitude_uA, 20.0);
  EXPECT_EQ(lower[1].frequency_Hz, 40.0);
}

TEST(StimulationGate, PulsesOfAStaleElectrodeRiseFromTheEndOfItsSilence) {
  TwoElectrodes output(two_electrodes(1000.0));
  const auto update_at_time = [&](milliseconds now) {
    return output.update(now - milliseconds{2}, 0.0, 0.0, 0.0, 0.0);
  };
  output.pass(milliseconds{100}, update_at_time(milliseconds{100}));
  // Its device is silent until 299 ms; the loop goes on.
  for (milliseconds now{101}; now < milliseconds{300}; ++now) {
    const bool updates = now.count() % 10 == 0;
    output.pass(now, updates ? update_at_time(now) : std::vector<StimulationCommand>{},
                milliseconds{100});
  }
  output.pass(milliseconds{300}, update_at_time(milliseconds{300}));
  const auto pulse = output.pass(milliseconds{305}, {output.pulse(milliseconds{303}, 80.0)});
  ASSERT_EQ(pulse.size(), 1U);
  EXPECT_DOUBLE_EQ(pulse[0].amplitude_uA, 6.0);  // 1000 µA/s for 6 ms
}

TEST(StimulationGate, NoPulseFollowsAnUpdateThatWasWithheld) {
  TwoElectrodes output(two_electrodes(0.0));
  output.pass(milliseconds{100}, output.update(milliseconds{98}, 0.0, 0.0, 0.0, 0.0));
  EXPECT_EQ(output.pass(milliseconds{110}, {output.pulse(milliseconds{108}, 50.0)}).size(), 1U);
  EXPECT_TRUE(output.pass(milliseconds{150}, output.update(milliseconds{112}, 9.0, 50.0, 0.0, 0.0))
                  .empty());
  EXPECT_TRUE(output.pass(milliseconds{151}, {output.pulse(milliseconds{149}, 50.0)}).empty());
  output.pass(milliseconds{160}, output.update(milliseconds{158}, 9.0, 50.0, 0.0, 0.0));
  EXPECT_EQ(output.pass(milliseconds{161}, {output.pulse(milliseconds{159}, 50.0)}).size(), 1U);
}

TEST(StimulationGate, NoPulseFollowsAJumpBeforeAnUpdate) {
  TwoElectrodes output(two_electrodes(0.0));
  output.pass(milliseconds{100}, output.update(milliseconds{98}, 0.0, 0.0, 0.0, 0.0));
  output.jump();
  EXPECT_TRUE(output.pass(milliseconds{105}, {output.pulse(milliseconds{103}, 50.0)}).empty());
  output.pass(milliseconds{110}, output.update(milliseconds{108}, 0.0, 0.0, 0.0, 0.0));
  EXPECT_EQ(output.pass(milliseconds{115}, {output.pulse(milliseconds{113}, 50.0)}).size(), 1U);
}

TEST(StimulationGate, NoPulseOfAnotherPatchFollowsAnOffBeforeAnUpdate) {
  EncodingParameters parameters = two_electrodes(0.0);
  parameters.electrodes[1].patch = 1;
  StimulationGate gate(parameters, kTick);
  const auto pass = [&](milliseconds now, const std::vector<StimulationCommand>& commands) {
    const nanoseconds newest[] = {milliseconds{100}, now};  // the first patch is silent
    return gate.pass(commands,
                     {.now = now, .delay = milliseconds{3}, .last_tick = now, .newest = newest});
  };
  const auto update = [](milliseconds time) {
    return TwoElectrodes::update(time, 10.0, 50.0, 0.0, 0.0);
  };
  pass(milliseconds{100}, update(milliseconds{98}));
  pass(milliseconds{155}, update(milliseconds{153}));
  EXPECT_EQ(pass(milliseconds{161}, {}).size(), 2U);
  EXPECT_TRUE(pass(milliseconds{162}, {TwoElectrodes::pulse(milliseconds{160}, 50.0)}).empty());
  pass(milliseconds{165}, update(milliseconds{163}));
  EXPECT_EQ(pass(milliseconds{166}, {TwoElectrodes::pulse(milliseconds{164}, 50.0)}).size(), 1U);
}

TEST(StimulationGate, APulseThatHasNotRisenDoesNotLeave) {
  TwoElectrodes output(two_electrodes(1000.0));
  output.pass(milliseconds{100}, output.update(milliseconds{98}, 0.0, 0.0, 0.0, 0.0));
  EXPECT_TRUE(output.pass(milliseconds{100}, {output.pulse(milliseconds{98}, 50.0)}).empty());
  EXPECT_EQ(output.pass(milliseconds{101}, {output.pulse(milliseconds{99}, 50.0)}).size(), 1U);
}

TEST(StimulationGate, EachElectrodeHasItsOwnSlope) {
  EncodingParameters parameters = two_electrodes(1000.0);
  parameters.electrodes[1].max_slope_uA_per_s = 2000.0;
  TwoElectrodes output(parameters);
  const auto leaving =
      output.pass(milliseconds{100}, output.update(milliseconds{98}, 80.0, 50.0, 80.0, 60.0));
  ASSERT_EQ(leaving.size(), 2U);
  EXPECT_DOUBLE_EQ(leaving[0].amplitude_uA, 12.0);
  EXPECT_DOUBLE_EQ(leaving[1].amplitude_uA, 24.0);
}

TEST(StimulationGate, NothingFollowsTheEnd) {
  OneElectrode output;
  output.pass(milliseconds{100}, 50.0);
  ASSERT_EQ(output.passed(milliseconds{105}, update_at(milliseconds{102}, 0.0, Stop::kEnd)).size(),
            1U);
  EXPECT_TRUE(output.passed(milliseconds{500}, {}, milliseconds{105}).empty());
}

TEST(StimulationGate, ARecordingThatIsPlayedAgainAfterItsEndIsWatched) {
  OneElectrode output;
  output.pass(milliseconds{100}, 50.0);
  output.passed(milliseconds{110}, update_at(milliseconds{108}, 0.0, Stop::kEnd));
  output.jump();
  const auto played =
      output.passed(milliseconds{120}, update_at(milliseconds{20}, 50.0), {}, {}, milliseconds{98});
  ASSERT_EQ(played.size(), 1U);
  EXPECT_EQ(played[0].amplitude_uA, 50.0);
  const auto off = output.passed(milliseconds{181}, {}, milliseconds{120}, {}, milliseconds{98});
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].stop, Stop::kStale);
}

TEST(StimulationGate, APartOfAnUpdateFromBeforeAJumpIsForgotten) {
  TwoElectrodes output(two_electrodes(0.0));
  const auto update = output.update(milliseconds{98}, 10.0, 50.0, 20.0, 60.0);
  EXPECT_TRUE(output.pass(milliseconds{100}, {update[0]}).empty());
  output.jump();
  const auto leaving = output.pass(milliseconds{101}, update);
  ASSERT_EQ(leaving.size(), 2U);
  EXPECT_EQ(leaving[0].electrode, 0);
  EXPECT_EQ(leaving[1].electrode, 1);
  EXPECT_EQ(leaving[1].amplitude_uA, 20.0);
}

TEST(StimulationGate, NoUpdateFollowsALaterPulse) {
  TwoElectrodes output(two_electrodes(0.0));
  output.pass(milliseconds{100}, output.update(milliseconds{98}, 0.0, 0.0, 0.0, 0.0));
  EXPECT_EQ(output.pass(milliseconds{110}, {output.pulse(milliseconds{109}, 50.0)}).size(), 1U);
  EXPECT_TRUE(output.pass(milliseconds{111}, output.update(milliseconds{107}, 9.0, 50.0, 0.0, 0.0))
                  .empty());
}

TEST(StimulationGate, AnOffHasTheProbeTimeOfItsInstant) {
  constexpr milliseconds kOffset{700};
  OneElectrode output;
  output.passed(milliseconds{1000}, update_at(milliseconds{298}, 50.0), {}, {}, kOffset);
  const auto off = output.passed(milliseconds{1061}, {}, milliseconds{1000}, {}, kOffset);
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].time, milliseconds{1061 - 700 - 3});
}

TEST(StimulationGate, SwitchesOffAfterAPauseOfItsThreadThatIsLongerThanTheWatchdog) {
  OneElectrode output;
  output.pass(milliseconds{100}, 50.0);
  // Updates are late only 10 ms later.
  const auto off = output.passed(milliseconds{165}, {});
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].stop, Stop::kStale);
}

TEST(StimulationGate, WaitsForAnUpdateAsLongAsTheWatchdogAndAnUpdateLast) {
  OneElectrode output;
  output.pass(milliseconds{100}, 50.0);
  EXPECT_TRUE(output.passed(milliseconds{150}, {}).empty());
  EXPECT_TRUE(output.passed(milliseconds{170}, {}).empty());
  const auto off = output.passed(milliseconds{171}, {});
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].stop, Stop::kStale);
  OneElectrode paused;
  paused.pass(milliseconds{100}, 50.0);
  EXPECT_TRUE(paused.passed(milliseconds{160}, {}).empty());  // exactly the watchdog
}

TEST(StimulationGate, PulsesAreNeverCloserThanTheirFrequencyAllows) {
  EncodingParameters parameters = two_electrodes(0.0);
  parameters.electrodes[1].frequency_Hz = {0.0, 300.0};  // 3.333 ms, known to a tick
  TwoElectrodes output(parameters);
  output.pass(milliseconds{100}, output.update(milliseconds{98}, 0.0, 0.0, 0.0, 0.0));
  const auto passes = [&](nanoseconds now) {
    return !output.pass(now, {output.pulse(now - milliseconds{1}, 30.0)}).empty();
  };
  EXPECT_TRUE(passes(milliseconds{105}));
  EXPECT_FALSE(passes(milliseconds{105} + nanoseconds{2'333'333}));
  EXPECT_TRUE(passes(milliseconds{105} + nanoseconds{2'333'334}));
}

TEST(StimulationGate, PulsesRiseFromTheLastOne) {
  TwoElectrodes output(two_electrodes(1000.0));
  output.pass(milliseconds{100}, output.update(milliseconds{98}, 0.0, 0.0, 0.0, 0.0));
  for (const int k : {1, 2, 3}) {
    const milliseconds now{100 + 10 * k};
    const auto pulse = output.pass(now, {output.pulse(now - milliseconds{2}, 80.0)});
    ASSERT_EQ(pulse.size(), 1U);
    EXPECT_DOUBLE_EQ(pulse[0].amplitude_uA, 10.0 * k);
    EXPECT_EQ(pulse[0].heartbeat, 1U);
  }
}

TEST(StimulationGate, AmplitudesBelowAMicroampereLeave) {
  OneElectrode one;
  const auto update = one.pass(milliseconds{100}, 0.5);
  ASSERT_EQ(update.size(), 1U);
  EXPECT_EQ(update[0].amplitude_uA, 0.5);
  EXPECT_EQ(update[0].frequency_Hz, 100.0);
  TwoElectrodes two(two_electrodes(0.0));
  two.pass(milliseconds{100}, two.update(milliseconds{98}, 0.0, 0.0, 0.0, 0.0));
  const auto pulse = two.pass(milliseconds{105}, {two.pulse(milliseconds{104}, 0.5)});
  ASSERT_EQ(pulse.size(), 1U);
  EXPECT_EQ(pulse[0].amplitude_uA, 0.5);
}

/// The loop, the device and the sink of a run on a simulated host, with faults.
class FaultyHost {
 public:
  enum class Fault {
    kNone,
    kLoopHangs,
    kProcessStops,
    kSenderDies,
    kSenderIsSlow,
    kDelayGrows,
    kClockJumps,
    kSinkStalls,
    kStarved
  };
  static constexpr int kFaults = 8;

  FaultyHost(std::uint64_t seed, const EncodingParameters& parameters)
      : random_(seed),
        parameters_(parameters),
        encoder_(*StimulationEncoder::create(parameters, grid_model())),
        feed_(encoder_, kTick),
        gate_(parameters, kTick),
        auditor_({.electrodes = 2,
                  .max_slope_uA_per_s = *parameters.stimulation.max_slope_uA_per_s,
                  .update = parameters.stimulation.update,
                  .watchdog = kWatchdog,
                  .tick = kTick,
                  .sink = milliseconds{5},
                  .pulse_interval = {milliseconds{5}, milliseconds{5}}}) {
    // The first second was measured, and is caught up.
    wall_ = milliseconds{1000};
    newest_ = wall_;
  }

  /// Plays faults. \return the first broken promise, or nothing
  std::string play(int faults) {
    for (int k = 0; k < faults; ++k) {
      run(milliseconds{100 + static_cast<int>(random_.next() % 300)}, Fault::kNone);
      const auto fault = static_cast<Fault>(1 + random_.next() % kFaults);
      const bool was_on = !auditor_.all_off();
      run(milliseconds{50 + static_cast<int>(random_.next() % 400)}, fault);
      on_ += was_on ? 1 : 0;
      if (!broken_.empty()) return broken_;
      if (!auditor_.fault().empty()) return auditor_.fault();
    }
    return "";
  }
  [[nodiscard]] int times_on() const { return on_; }
  [[nodiscard]] const StimulationGate::Counts& counts() const { return gate_.counts(); }

 private:
  void run(milliseconds length, Fault fault) {
    const nanoseconds began = wall_;
    if (fault == Fault::kClockJumps) {
      clock_error_ = milliseconds{static_cast<int>(random_.next() % 600) - 300};
    }
    const nanoseconds last_sample = newest_;
    for (const nanoseconds end = wall_ + length; wall_ < end; wall_ += microseconds{250}) {
      const bool stopped = fault == Fault::kProcessStops;
      const bool starved = fault == Fault::kStarved && random_.uniform() < 0.9;
      if (fault == Fault::kDelayGrows)
        delay_ = std::min<nanoseconds>(delay_ + kTick / 8, most_delay_);
      if (fault == Fault::kNone)
        delay_ -= std::min<nanoseconds>(delay_ - least_delay_, kTick / 200);
      receive(fault);
      if (!stopped && !starved && fault != Fault::kLoopHangs) tick();
      const bool polls = wall_.count() % 1'000'000 == 0;
      if (!stopped && !starved && fault != Fault::kSinkStalls && polls) pass();
      check_off(fault, wall_ - began, wall_ - last_sample);
    }
    if (fault == Fault::kClockJumps) clock_error_ = nanoseconds{0};
  }

  void receive(Fault fault) {
    if (fault == Fault::kSenderDies || wall_.count() % 1'000'000 != 0) return;
    const nanoseconds age = fault == Fault::kSenderIsSlow ? milliseconds{40} : microseconds{200};
    newest_ = std::max(newest_, wall_ - age + clock_error_);
  }

  void tick() {
    const auto due = [&] { return feed_.now() + kTick + delay_; };
    const auto behind = (wall_ - due()) / kTick;
    if (behind > 20 && started_) feed_.skip(static_cast<int>(behind));
    for (; due() <= wall_; started_ = started_ || due() > wall_) {
      const nanoseconds end = feed_.now() + kTick;
      force_mN_ = std::clamp(force_mN_ + random_.uniform(-30.0, 30.0), 0.0, 600.0);
      if (random_.uniform() < 0.005) force_mN_ = random_.uniform(0.0, 600.0);
      feed_.press = {};
      feed_.press.x_mm = 15.0;
      feed_.press.y_mm = 10.0;
      feed_.press.contact = {.depth_mm = 1.0, .force_mN = force_mN_, .contact_radius_mm = 1.0};
      feed_.state = end > newest_ + milliseconds{150} ? TickRecord::State::kReleased
                                                      : TickRecord::State::kFollowing;
      if (random_.uniform() < 0.3) feed_.spike(microseconds{500}, 315);
      const auto commands = feed_.step();
      queue_.insert(queue_.end(), commands.begin(), commands.end());
      last_tick_ = wall_;
    }
  }

  void pass() {
    // The batches of a queue may end within an update.
    const std::size_t first = random_.uniform() < 0.2 && !queue_.empty() ? 1 : queue_.size();
    const Moment moment{
        .now = wall_, .delay = delay_, .last_tick = last_tick_, .newest = {&newest_, 1}};
    auditor_.take(wall_, delay_, commands_of(gate_.pass(std::span(queue_).first(first), moment)));
    auditor_.take(wall_, delay_, commands_of(gate_.pass(std::span(queue_).subspan(first), moment)));
    queue_.clear();
  }

  /// While a fault lasts, everything is off after the watchdog and 5 ms.
  void check_off(Fault fault, nanoseconds lasted, nanoseconds silent) {
    const bool off = fault == Fault::kLoopHangs || fault == Fault::kSenderDies;
    const nanoseconds since = fault == Fault::kSenderDies ? silent : lasted;
    if (off && since > kWatchdog + milliseconds{5} && !auditor_.all_off() && broken_.empty()) {
      broken_ = "an electrode is on " + std::to_string(since.count()) + " ns after fault " +
                std::to_string(static_cast<int>(fault));
    }
  }

  Random random_;
  EncodingParameters parameters_;
  StimulationEncoder encoder_;
  TickFeed feed_;
  StimulationGate gate_;
  WallAuditor auditor_;
  std::vector<StimulationCommand> queue_;
  nanoseconds wall_{0};
  nanoseconds least_delay_ = milliseconds{2};
  nanoseconds most_delay_ = milliseconds{50};
  nanoseconds delay_ = milliseconds{2};
  nanoseconds newest_{0};
  nanoseconds clock_error_{0};
  nanoseconds last_tick_{0};
  double force_mN_ = 300.0;
  bool started_ = false;
  int on_ = 0;
  std::string broken_;
};

TEST(StimulationGate, KeepsItsPromisesThroughThousandsOfFaults) {
  int on = 0;
  std::uint64_t withheld = 0;
  std::uint64_t stale = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    FaultyHost host(seed, two_electrodes(2000.0));
    ASSERT_EQ(host.play(40), "") << "seed " << seed;
    on += host.times_on();
    withheld += host.counts().withheld;
    stale += host.counts().stale;
  }
  EXPECT_GT(on, 1500);
  EXPECT_GT(withheld, 60U * 100U);  // the backlog of the start alone
  EXPECT_GT(stale, 500U);
}

}  // namespace
}  // namespace merkel
