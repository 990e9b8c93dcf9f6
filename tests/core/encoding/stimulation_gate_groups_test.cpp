// What the gate does for groups of electrodes and for the steps of a stimulator.
#include <vector>

#include <gtest/gtest.h>

#include "core/encoding/stimulation_gate.hpp"
#include "tests/core/encoding/tick_feed.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;

/// A gate of three electrodes, of which the first two are a group, on a host without delays.
class GroupedGate {
 public:
  explicit GroupedGate(const EncodingParameters& parameters) : gate_(parameters, kTick) {}

  std::vector<StimulationCommand> pass(nanoseconds now,
                                       const std::vector<StimulationCommand>& commands) {
    const auto leaving =
        gate_.pass(commands, {.now = now, .delay = milliseconds{3}, .last_tick = now});
    std::vector<StimulationCommand> commands_left;
    for (const SentCommand& each : leaving) commands_left.push_back(each.command);
    return commands_left;
  }
  std::vector<StimulationCommand> update(nanoseconds now, double amplitude_uA) {
    std::vector<StimulationCommand> commands;
    for (std::uint16_t e = 0; e < 3; ++e) {
      commands.push_back({.time = now,
                          .amplitude_uA = e == 2 ? amplitude_uA : 0.0,
                          .frequency_Hz = e == 2 ? 100.9 : 0.0,
                          .electrode = e});
    }
    return pass(now, commands);
  }
  static StimulationCommand pulse(nanoseconds time, double amplitude_uA, std::uint16_t electrode) {
    return {
        .time = time, .amplitude_uA = amplitude_uA, .electrode = electrode, .kind = Kind::kPulse};
  }
  void jump() { gate_.jump(); }
  [[nodiscard]] const StimulationGate::Counts& counts() const { return gate_.counts(); }

 private:
  StimulationGate gate_;
};

EncodingParameters grouped() {
  EncodingParameters parameters = encoding_of({});
  for (int e = 0; e < 3; ++e) {
    parameters.electrodes.push_back(
        electrode_at("E" + std::to_string(e + 1), EncoderKind::kLinear, 15.0, 10.0, 3.0));
  }
  parameters.groups.emplace_back().pattern.name = "tip";
  parameters.electrodes[0].group = parameters.electrodes[1].group = 0;
  return parameters;
}

TEST(StimulationGateGroups, PulsesOfAGroupThatWaitedTogetherDoNotLeaveTogether) {
  GroupedGate gate(grouped());
  gate.update(milliseconds{100}, 0.0);
  // The sink comes late: pulses of two ticks leave now.
  const auto leaving = gate.pass(milliseconds{103}, {gate.pulse(milliseconds{101}, 30.0, 0),
                                                     gate.pulse(microseconds{101'500}, 30.0, 2),
                                                     gate.pulse(milliseconds{102}, 30.0, 1)});
  ASSERT_EQ(leaving.size(), 2U);
  EXPECT_EQ(leaving[0].electrode, 0);
  EXPECT_EQ(leaving[1].electrode, 2);  // of no group
  EXPECT_EQ(gate.counts().withheld, 1U);
  // The pulse of 400 µs is over.
  EXPECT_TRUE(gate.pass(microseconds{103'399}, {gate.pulse(milliseconds{103}, 30.0, 1)}).empty());
  EXPECT_EQ(gate.pass(microseconds{103'400}, {gate.pulse(milliseconds{103}, 30.0, 1)}).size(), 1U);
}

TEST(StimulationGateGroups, ACommandOfAnElectrodeThatDoesNotExistIsIgnored) {
  GroupedGate gate(grouped());
  std::vector<StimulationCommand> commands(4);
  for (std::uint16_t e = 0; e < 4; ++e) {
    commands[e] = {.time = milliseconds{100}, .electrode = static_cast<std::uint16_t>(3 - e)};
  }
  const auto leaving = gate.pass(milliseconds{100}, commands);
  ASSERT_EQ(leaving.size(), 3U);
  for (const StimulationCommand& each : leaving) EXPECT_LT(each.electrode, 3);
}

TEST(StimulationGateGroups, TheChargeOfASecondIsNotForgottenWhenARecordingIsPlayedAgain) {
  EncodingParameters parameters = grouped();
  parameters.groups.insert(parameters.groups.begin(),
                           parameters.groups.front());  // of no electrode
  parameters.electrodes[0].group = parameters.electrodes[1].group = 1;
  parameters.groups[1].max_charge_nC_per_s = 64.0;  // four pulses of 80 µA for 200 µs
  GroupedGate gate(parameters);
  std::vector<nanoseconds> left;
  for (int k = 0; k < 100; ++k) {
    const nanoseconds now = milliseconds{20 * (k + 1)};
    if (k % 10 == 9) gate.jump();  // in probe time, the charge of the last second is unknown
    gate.update(now, 0.0);
    const auto electrode = static_cast<std::uint16_t>(k % 2);
    if (!gate.pass(now, {gate.pulse(now, 80.0, electrode)}).empty()) left.push_back(now);
  }
  ASSERT_EQ(left.size(), 8U);
  for (std::size_t k = 4; k < left.size(); ++k) {
    EXPECT_EQ(left[k] - left[k - 4], std::chrono::seconds{1});
  }
  EXPECT_EQ(gate.counts().withheld, 92U);
  // A pulse of the electrode that is in no group does not count.
  EXPECT_EQ(gate.pass(milliseconds{2'001}, {gate.pulse(milliseconds{2'001}, 80.0, 2)}).size(), 1U);
}

TEST(StimulationGateGroups, ASecondHasRoomForTheShortestPulsesOfTheGroup) {
  for (const auto shortest : {std::uint16_t{0}, std::uint16_t{1}}) {
    EncodingParameters parameters = grouped();
    parameters.groups.insert(parameters.groups.begin(),
                             parameters.groups.front());  // of no electrode
    parameters.electrodes[0].group = parameters.electrodes[1].group = 1;
    // 166 of these pulses fill a second; the last electrode is in no group.
    for (Electrode& each : parameters.electrodes) each.phase = microseconds{3000};
    parameters.electrodes[shortest].phase.reset();
    GroupedGate gate(parameters);
    std::size_t left = 0;
    for (int k = 0; k < 250; ++k) {
      const nanoseconds now = milliseconds{100 + 4 * k};
      gate.update(now, 0.0);
      left += gate.pass(now, {gate.pulse(now, 5.0, shortest)}).size();
    }
    EXPECT_EQ(left, 250U);
  }
}

TEST(StimulationGateGroups, WhatLeavesIsOnTheStepsOfTheStimulator) {
  EncodingParameters parameters = grouped();
  parameters.stimulation.max_slope_uA_per_s = 250.0;
  parameters.stimulator.name = "box";
  parameters.stimulator.min_amplitude_uA = 1.0;
  parameters.stimulator.amplitude_step_uA = 1.0;
  parameters.stimulator.frequency_step_Hz = 1.0;
  GroupedGate gate(parameters);
  // 2.5 µA in 10 ms; the amplitude rises on although only whole microamperes leave.
  EXPECT_EQ(gate.update(milliseconds{100}, 80.0)[2].amplitude_uA, 3.0);  // an update and two ticks
  EXPECT_EQ(gate.update(milliseconds{110}, 80.0)[2].amplitude_uA, 5.0);
  const auto third = gate.update(milliseconds{120}, 80.0);
  EXPECT_EQ(third[2].amplitude_uA, 8.0);
  EXPECT_EQ(third[2].frequency_Hz, 100.0);
  // A pulse below the weakest amplitude does not leave.
  EXPECT_TRUE(gate.pass(milliseconds{121}, {gate.pulse(milliseconds{121}, 0.9, 0)}).empty());
  const auto pulse = gate.pass(milliseconds{127}, {gate.pulse(milliseconds{127}, 4.7, 1)});
  ASSERT_EQ(pulse.size(), 1U);
  EXPECT_EQ(pulse[0].amplitude_uA, 4.0);
}

}  // namespace
}  // namespace merkel
