// Electrodes that act as one: one field, one drive, staggered pulses, a limit for their charge.
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/encoding/field_map.hpp"
#include "tests/core/encoding/tick_feed.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;

/// Electrodes around the middle of the patch, in one group that follows the force.
EncodingParameters group_of(int electrodes) {
  EncodingParameters parameters = encoding_of({});
  ElectrodeGroup& group = parameters.groups.emplace_back();
  group.pattern.name = "tip";
  group.pattern.encoder = EncoderKind::kLinear;
  group.pattern.frequency_Hz = {50.0, 100.0};
  for (int e = 0; e < electrodes; ++e) {
    auto electrode =
        electrode_at("E" + std::to_string(e + 1), EncoderKind::kRate, 14.0 + e, 10.0, 3.0);
    electrode.amplitude_uA = {20.0 + e, 80.0 - e};
    electrode.group = 0;
    parameters.electrodes.push_back(electrode);
  }
  parameters.join_groups();
  return parameters;
}

Press press_of(double force_mN, double x_mm = 15.0) {
  return {.contact = {.depth_mm = 0.5, .force_mN = force_mN, .contact_radius_mm = 1.0},
          .x_mm = x_mm,
          .y_mm = 10.0};
}

std::vector<StimulationCommand> pulses_of(StimulationEncoder& encoder, TickFeed& feed, int ticks) {
  std::vector<StimulationCommand> pulses;
  for (int k = 0; k < ticks; ++k) {
    for (const auto& command : feed.step()) {
      if (command.kind == Kind::kPulse) {
        pulses.push_back(command);
      } else {
        EXPECT_EQ(command.amplitude_uA, 0.0) << "the trains of a group are pulses";
      }
    }
  }
  EXPECT_EQ(encoder.clippings().group, 0U);
  return pulses;
}

TEST(ElectrodeGroups, PulseInTurnEvenlySpacedAtOneFrequency) {
  auto encoder = *StimulationEncoder::create(group_of(4), grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = press_of(500.0);  // half the force: 75 Hz
  const auto pulses = pulses_of(encoder, feed, 400);
  ASSERT_EQ(pulses.size(), 120U);  // 4 × 75 Hz in 400 ms
  for (std::size_t k = 1; k < pulses.size(); ++k) {
    EXPECT_EQ(pulses[k].electrode, k % 4);
    EXPECT_EQ(pulses[k].time - pulses[k - 1].time, nanoseconds{3'333'334});
    const double e = static_cast<double>(k % 4);
    EXPECT_DOUBLE_EQ(pulses[k].amplitude_uA, 0.5 * (20.0 + e + 80.0 - e));
  }
}

TEST(ElectrodeGroups, EachHasItsOwnTurnAndItsOwnCharge) {
  EncodingParameters parameters = group_of(2);
  parameters.groups.push_back(parameters.groups[0]);
  parameters.groups[1].pattern.name = "side";
  parameters.groups[1].max_charge_nC_per_s = 40.0;  // four pulses of 50 µA for 200 µs
  for (int e = 0; e < 2; ++e) {
    parameters.electrodes.push_back(parameters.electrodes[0]);
    parameters.electrodes.back().name = "S" + std::to_string(e + 1);
    parameters.electrodes.back().group = 1;
  }
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = press_of(500.0);
  std::map<int, int> pulses;
  for (int k = 0; k < 400; ++k) {
    for (const auto& command : feed.step())
      pulses[command.electrode] += command.kind == Kind::kPulse;
  }
  EXPECT_EQ(pulses, (std::map<int, int>{{0, 30}, {1, 30}, {2, 2}, {3, 2}}));
  EXPECT_EQ(encoder.clippings().group, 56U);
}

TEST(ElectrodeGroups, BeginAtOnceAndChangeTheirFrequencyAtOnce) {
  auto encoder = *StimulationEncoder::create(group_of(2), grid_model());
  TickFeed feed(encoder, kTick);
  EXPECT_TRUE(pulses_of(encoder, feed, 20).empty());
  feed.press = press_of(1.0);
  // The update at the end of the first tick of the grid, and the tick after it.
  const auto slow = pulses_of(encoder, feed, 21);
  ASSERT_EQ(slow.size(), 3U);
  EXPECT_EQ(slow[0].time, milliseconds{21} + nanoseconds{1});
  EXPECT_EQ(slow[1].time - slow[0].time, nanoseconds{9'990'010});  // 2 × 50.05 Hz
  feed.press = press_of(1000.0);
  pulses_of(encoder, feed, 10);
  const auto fast = pulses_of(encoder, feed, 20);
  ASSERT_GE(fast.size(), 3U);
  EXPECT_EQ(fast[2].time - fast[1].time, milliseconds{5});
}

TEST(ElectrodeGroups, BeginAtOnceWithTheNextElectrodeAfterAPause) {
  auto encoder = *StimulationEncoder::create(group_of(3), grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = press_of(1000.0);
  auto pulses = pulses_of(encoder, feed, 31).size();
  feed.press = {};
  pulses += pulses_of(encoder, feed, 100).size();  // the update at 41 ms ends them
  feed.press = press_of(1000.0);
  const auto after = pulses_of(encoder, feed, 11);  // the update at 141 ms begins them
  ASSERT_FALSE(after.empty());
  EXPECT_EQ(after[0].time, milliseconds{141} + nanoseconds{1});
  EXPECT_EQ(after[0].electrode, pulses % 3);
}

TEST(ElectrodeGroups, AFaultStopsThemAndTheirTurnGoesOn) {
  auto encoder = *StimulationEncoder::create(group_of(3), grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = press_of(1000.0);
  const auto before = pulses_of(encoder, feed, 30);
  feed.state = TickRecord::State::kReleased;
  EXPECT_TRUE(pulses_of(encoder, feed, 50).empty());
  feed.state = TickRecord::State::kFollowing;
  const auto after = pulses_of(encoder, feed, 30);
  ASSERT_FALSE(after.empty());
  encoder.reset();
  TickFeed again(encoder, kTick);
  again.press = press_of(1000.0);
  const auto restarted = pulses_of(encoder, again, 30);
  ASSERT_EQ(restarted.size(), before.size());
  EXPECT_EQ(restarted[0].electrode, 0);
  EXPECT_EQ(restarted[0].time, before[0].time);
}

TEST(ElectrodeGroups, AFaultOfAnotherPatchDoesNotStopThem) {
  const EncodedModel model = two_patch_model();
  EncodingParameters parameters = group_of(2);
  for (Electrode& each : parameters.electrodes) each.patch = 1;
  auto encoder = *StimulationEncoder::create(parameters, model);
  const std::vector presses = {Press{}, press_of(1000.0)};
  std::map<bool, int> pulses;
  for (int k = 1; k <= 40; ++k) {
    const bool own = k > 20;  // whether the fault is of the group's own patch
    std::vector<TickRecord> records = {{.time = k * kTick, .probe = 0},
                                       {.time = k * kTick, .probe = 1}};
    records[own ? 1 : 0].state = TickRecord::State::kReleased;
    for (const auto& command : encoder.step({.records = records, .presses = presses})) {
      pulses[own] += command.kind == Kind::kPulse;
    }
  }
  EXPECT_GE(pulses[false], 3);
  EXPECT_EQ(pulses[true], 0);
}

TEST(ElectrodeGroups, AnElectrodeBesideThemKeepsItsOwnSettings) {
  EncodingParameters parameters = group_of(2);
  parameters.electrodes.push_back(electrode_at("alone", EncoderKind::kOkorokova, 5.0, 5.0, 1.5));
  parameters.join_groups();
  EXPECT_EQ(parameters.electrodes[2].encoder, EncoderKind::kOkorokova);
  EXPECT_EQ(parameters.electrodes[2].field_mm, (std::vector{5.0, 5.0, 1.5}));
  EXPECT_EQ(parameters.electrodes[1].encoder, EncoderKind::kLinear);
}

TEST(ElectrodeGroups, AnElectrodeInThemKeepsItsOwnLimits) {
  EncodingParameters parameters = group_of(2);
  parameters.electrodes[1].max_slope_uA_per_s = 500.0;
  parameters.electrodes[1].max_amplitude_uA = 79.0;
  parameters.electrodes[1].max_charge_nC = 15.8;
  parameters.electrodes[1].phase = microseconds{150};
  parameters.join_groups();
  EXPECT_EQ(parameters.electrodes[1].max_slope_uA_per_s, 500.0);
  EXPECT_EQ(parameters.electrodes[1].max_amplitude_uA, 79.0);
  EXPECT_EQ(parameters.electrodes[1].max_charge_nC, 15.8);
  EXPECT_EQ(parameters.electrodes[1].phase, microseconds{150});
}

TEST(ElectrodeGroups, BeginWithTheirFirstElectrodeAfterAReset) {
  auto encoder = *StimulationEncoder::create(group_of(3), grid_model());
  for (int run = 0; run < 2; ++run) {
    TickFeed feed(encoder, kTick);
    feed.press = press_of(1000.0);
    const auto pulses = pulses_of(encoder, feed, 3);
    ASSERT_EQ(pulses.size(), 1U);
    EXPECT_EQ(pulses[0].electrode, 0);
    encoder.reset();
  }
}

TEST(ElectrodeGroups, AlsoPulseAtTheEndOfATick) {
  EncodingParameters parameters = group_of(2);
  parameters.groups[0].pattern.frequency_Hz = {100.000021, 100.000021};
  parameters.join_groups();
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = press_of(1000.0);
  const auto pulses = pulses_of(encoder, feed, 10);
  ASSERT_EQ(pulses.size(), 2U);
  EXPECT_EQ(pulses[0].time, milliseconds{1} + nanoseconds{1});
  EXPECT_EQ(pulses[1].time, milliseconds{6});
}

TEST(ElectrodeGroups, PulseAlsoLessThanOnceASecond) {
  EncodingParameters parameters = group_of(2);
  parameters.groups[0].pattern.frequency_Hz = {0.4, 0.4};
  parameters.join_groups();
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = press_of(500.0);
  EXPECT_EQ(pulses_of(encoder, feed, 1260).size(), 2U);  // every 1.25 s
}

TEST(ElectrodeGroups, InvalidDrivesSwitchThemOffAndAreCounted) {
  for (const EncoderKind kind : {EncoderKind::kLinear, EncoderKind::kLinearAmplitude}) {
    EncodingParameters parameters = group_of(2);
    parameters.groups[0].pattern.encoder = kind;
    parameters.groups[0].pattern.frequency_Hz[1] = 300.0;
    parameters.join_groups();
    auto encoder = *StimulationEncoder::create(parameters, grid_model());
    TickFeed feed(encoder, kTick);
    feed.press = press_of(std::nan(""));
    EXPECT_TRUE(pulses_of(encoder, feed, 50).empty());
    EXPECT_EQ(encoder.clippings().invalid, 2U * 5U);
  }
}

TEST(ElectrodeGroups, HaveOneFieldOfTheirElectrodesWithWeightsAndABorder) {
  EncodingParameters parameters = group_of(2);
  parameters.groups[0].pattern.border_mm = 2.0;
  parameters.electrodes[1].field_mm = {24.0, 10.0, 2.0};
  parameters.electrodes[1].group_weight = 0.5;
  parameters.join_groups();
  const EncoderSources encoding(parameters);
  ASSERT_EQ(encoding.sources.size(), 1U);
  EXPECT_EQ(encoding.of_electrode, (std::vector<std::size_t>{0, 0}));
  const FieldMap& map = encoding.sources[0].map;
  EXPECT_EQ(map.weight(14.0, 13.0), 1.0);  // at the radius of E1
  EXPECT_DOUBLE_EQ(map.weight(14.0, 13.5), 0.75);
  EXPECT_DOUBLE_EQ(map.weight(14.0, 14.5), 0.25);
  EXPECT_EQ(map.weight(14.0, 15.0), 0.0);
  EXPECT_EQ(FieldMap(electrode_at("E", EncoderKind::kRate, 14.0, 10.0, 3.0)).weight(14.0, 13.0),
            1.0);
  EXPECT_EQ(map.weight(24.0, 11.0), 0.5);
  EXPECT_DOUBLE_EQ(map.weight(27.0, 10.0), 0.25);
  EXPECT_DOUBLE_EQ(map.weight(18.0, 10.0, 0.5), 0.75);  // a contact reaches 0.5 mm further
  // A field of the group replaces those of its electrodes.
  parameters.groups[0].pattern.field_mm = {5.0, 5.0, 1.0};
  parameters.join_groups();
  EXPECT_EQ(EncoderSources(parameters).sources[0].map.weight(14.0, 10.0), 0.0);
  EXPECT_EQ(parameters.electrodes[1].field_mm, (std::vector{5.0, 5.0, 1.0}));
}

TEST(ElectrodeGroups, TheForceOfAContactInTheBorderCountsByItsWeight) {
  EncodingParameters parameters = group_of(2);
  parameters.groups[0].pattern.border_mm = 2.0;
  parameters.groups[0].pattern.field_mm = {15.0, 10.0, 3.0};
  parameters.join_groups();
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = press_of(1000.0, 15.0 + 3.0 + 1.0 + 0.5);  // 0.5 mm into the border: 3/4
  const auto pulses = pulses_of(encoder, feed, 30);
  ASSERT_FALSE(pulses.empty());
  EXPECT_DOUBLE_EQ(pulses[0].amplitude_uA, 20.0 + 0.75 * 60.0);
}

TEST(ElectrodeGroups, RateWeighsTheSpikesOfTheBorder) {
  EncodingParameters parameters = encoding_of({});
  auto electrode = electrode_at("E1", EncoderKind::kRate, 12.0, 8.0, 2.0);
  electrode.border_mm = 2.0;
  parameters.electrodes = {electrode};
  auto weighted = *StimulationEncoder::create(parameters, grid_model());
  EXPECT_GT(weighted.afferents(0), 40U);
  TickFeed feed(weighted, kTick);
  const auto weight = [](std::uint32_t neuron) {
    const double x_mm = (neuron - 1) % 30 + 0.5;
    const std::uint32_t row = (neuron - 1) / 30;
    const double y_mm = row + 0.5;
    return std::clamp(1.0 - (std::hypot(x_mm - 12.0, y_mm - 8.0) - 2.0) / 2.0, 0.0, 1.0);
  };
  double total = 0.0;
  for (std::uint32_t n = 1; n <= 600; ++n) total += weight(n);
  // One spike each of an afferent in the border and of one in the middle, at the tick's begin.
  const std::uint32_t border = 7 * 30 + 9 + 1;   // (9.5, 7.5)
  const std::uint32_t middle = 7 * 30 + 12 + 1;  // (12.5, 7.5)
  ASSERT_GT(weight(border), 0.0);
  ASSERT_LT(weight(border), 1.0);
  double frequency_Hz = 0.0;
  for (int repeat = 0; repeat < 40; ++repeat) feed.spike(nanoseconds{0}, border);
  for (int repeat = 0; repeat < 40; ++repeat) feed.spike(nanoseconds{0}, middle);
  for (const auto& command : feed.step()) frequency_Hz = command.frequency_Hz;
  const double rate_Hz = 40.0 * (weight(border) + 1.0) * std::exp(-1.0 / 30.0) / (0.03 * total);
  EXPECT_NEAR(frequency_Hz, 200.0 * rate_Hz / 100.0, 1e-9);
}

TEST(ElectrodeGroups, AFieldWhoseAfferentsAreAllInItsBorderWeighsThem) {
  EncodingParameters parameters = encoding_of({});
  auto electrode = electrode_at("E1", EncoderKind::kRate, 12.0, 8.0, 0.1);
  electrode.border_mm = 1.0;  // the nearest afferents are 0.71 mm away
  parameters.electrodes = {electrode};
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  ASSERT_EQ(encoder.afferents(0), 4U);
  TickFeed feed(encoder, kTick);
  feed.spike(nanoseconds{0}, 7 * 30 + 11 + 1);  // one of four equal ones
  double frequency_Hz = 0.0;
  for (const auto& command : feed.step()) frequency_Hz = command.frequency_Hz;
  const double rate_Hz = std::exp(-1.0 / 30.0) / (0.03 * 4.0);
  EXPECT_NEAR(frequency_Hz, 200.0 * rate_Hz / 100.0, 1e-9);
}

/// Moves the last two of four electrodes to a second group.
void split(EncodingParameters& parameters) {
  parameters.groups.push_back(parameters.groups[0]);
  parameters.groups[1].pattern.name = "side";
  parameters.electrodes[2].group = parameters.electrodes[3].group = 1;
}

std::string refusal_of(const std::function<void(EncodingParameters&)>& change) {
  EncodingParameters parameters = group_of(4);
  change(parameters);
  parameters.join_groups();
  const auto encoder = StimulationEncoder::create(parameters, grid_model());
  return encoder ? "" : encoder.error().key + " " + encoder.error().reason;
}

TEST(ElectrodeGroups, AreRefusedWithAdviceWhereTheyCannotBe) {
  EXPECT_EQ(refusal_of([](auto&) {}), "");
  EXPECT_EQ(refusal_of([](auto& p) { p.groups[0].pattern.frequency_Hz[1] = 250.0; }), "");
  EXPECT_EQ(refusal_of([](auto& p) { p.groups[0].pattern.frequency_Hz[1] = 251.0; }),
            "electrode_group[tip].frequency_Hz is too high to stagger the pulses of 4 electrodes: "
            "with 1 ms between two pulses (a tick and a pulse, whichever is longer), it is at most "
            "250");
  EXPECT_EQ(refusal_of([](auto& p) { p.stimulation.interphase = microseconds{1600}; }), "");
  EXPECT_EQ(refusal_of([](auto& p) { p.stimulation.interphase = microseconds{2200}; }),
            "electrode_group[tip].frequency_Hz is too high to stagger the pulses of 4 electrodes: "
            "with 2.6 ms between two pulses (a tick and a pulse, whichever is longer), it is at "
            "most 96");
  EXPECT_EQ(refusal_of([](auto& p) {
              split(p);
              p.groups[1].pattern.frequency_Hz[1] = 501.0;
            }),
            "electrode_group[side].frequency_Hz is too high to stagger the pulses of 2 electrodes: "
            "with 1 ms between two pulses (a tick and a pulse, whichever is longer), it is at most "
            "500");
  EXPECT_EQ(refusal_of([](auto& p) {
              split(p);
              p.stimulation.interphase = microseconds{2200};
              p.groups[1].pattern.frequency_Hz[1] = 193.0;
            }),
            "electrode_group[side].frequency_Hz is too high to stagger the pulses of 2 electrodes: "
            "with 2.6 ms between two pulses (a tick and a pulse, whichever is longer), it is at "
            "most 192");
  EXPECT_EQ(refusal_of([](auto& p) {
              split(p);
              p.electrodes[3].patch = 1;
            }),
            "electrode[E4].patch must be that of E3, which is in the same group");
  EXPECT_EQ(refusal_of([](auto& p) {
              p.groups.resize(3, p.groups[0]);
              p.groups[1].pattern.name = p.groups[2].pattern.name = "side";
              p.electrodes[1].group = p.electrodes[3].group = 1;
              for (std::size_t e = 0; e < 2; ++e) {
                p.electrodes.push_back(p.electrodes[e]);
                p.electrodes.back().name = "S" + std::to_string(e);
                p.electrodes.back().group = 2;
              }
            }),
            "electrode_group.name \"side\" is used by two groups: give each its own name");
  EXPECT_EQ(refusal_of([](auto& p) {
              p.groups[0].pattern.frequency_Hz[1] = 250.0;
              auto alone = electrode_at("alone", EncoderKind::kLinear, 5.0, 5.0, 1.5);
              alone.phase = milliseconds{1};
              alone.amplitude_uA = {1.0, 10.0};
              p.electrodes.push_back(alone);
            }),
            "");
  EXPECT_TRUE(refusal_of([](auto& p) {
                p.groups[0].pattern.full_rate_Hz = 0.0;
              }).starts_with("electrode_group[tip].full_rate_Hz"));
  EXPECT_NE(refusal_of([](auto& p) { p.groups[0].pattern.frequency_Hz = {}; }), "");
  EXPECT_NE(refusal_of([](auto& p) { p.groups[0].pattern.name = ""; }), "");
  EXPECT_NE(refusal_of([](auto& p) { p.groups[0].pattern.field_mm = {1.0, 2.0}; }), "");
  EXPECT_NE(refusal_of([](auto& p) { p.groups[0].max_charge_nC_per_s = 0.0; }), "");
  EXPECT_EQ(refusal_of([](auto& p) { p.groups[0].pattern.encoder = EncoderKind::kPulsePerSpike; }),
            "electrode_group[tip].encoder must not be pulse_per_spike, because pulses of a group "
            "are staggered: use rate");
  EXPECT_EQ(refusal_of([](auto& p) { p.electrodes.resize(1); }),
            "electrode_group[tip].name must be that of at least two electrodes: give them group = "
            "\"tip\"");
  EXPECT_EQ(refusal_of([](auto& p) { p.electrodes[2].patch = 1; }),
            "electrode[E3].patch must be that of E1, which is in the same group");
  EXPECT_EQ(refusal_of([](auto& p) {
              p.groups.push_back(p.groups[0]);
              p.electrodes[2].group = p.electrodes[3].group = 1;
            }),
            "electrode_group.name \"tip\" is used by two groups: give each its own name");
  EXPECT_EQ(refusal_of([](auto& p) {
              p.groups[0].pattern.encoder = EncoderKind::kRate;
              p.groups[0].pattern.field_mm = {15.0, 10.0, 0.1};
            }),
            "electrode_group[tip].field_mm contains no afferent: move it or enlarge its radius "
            "(merkel inspect afferents prints their positions)");
  EncodingParameters own = group_of(2);
  own.electrodes[1].frequency_Hz = {0.0, 300.0};
  const auto checked = own.check();
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().key + " " + checked.error().reason,
            "electrode[E2].frequency_Hz must be that of its group");
}

StimulationCommand pulse_at(nanoseconds time, double amplitude_uA, std::uint16_t electrode) {
  return {.time = time, .amplitude_uA = amplitude_uA, .electrode = electrode, .kind = Kind::kPulse};
}

TEST(ElectrodeGroups, TheLimiterDropsPulsesThatAreTooClose) {
  StimulationLimiter limiter({.max_total_uA = 1e6, .groups = {{.gap = milliseconds{1}}}},
                             {{.max_uA = 80.0, .max_Hz = 500.0, .group = 0},
                              {.max_uA = 80.0, .max_Hz = 500.0, .group = 0},
                              {.max_uA = 80.0, .max_Hz = 500.0}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse_at(microseconds{900}, 80.0, 0), pulse_at(microseconds{1500}, 80.0, 2),
                        pulse_at(microseconds{1899}, 80.0, 1),
                        pulse_at(microseconds{1900}, 80.0, 1)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 3U);
  EXPECT_EQ(pulses[1].electrode, 2);  // of no group
  EXPECT_EQ(pulses[2].time, microseconds{1900});
  EXPECT_EQ(limiter.clippings().group, 1U);
  EXPECT_EQ(limiter.clippings().all(), 1U);
  // Everything is off after a reset, so that a pulse may follow at once.
  limiter.reset(microseconds{1'500});
  std::vector next = {pulse_at(microseconds{1'600}, 80.0, 0)};
  EXPECT_EQ(limiter.limit_pulses(next, microseconds{1'500}), 1U);
}

TEST(ElectrodeGroups, TheLimiterKeepsTheChargeOfAnySecond) {
  // 80 µA for 200 µs are 16 nC: four pulses are 64 nC.
  StimulationLimiter limiter(
      {.max_total_uA = 1e6, .groups = {{.gap = milliseconds{1}, .max_charge_nC_per_s = 64.0}}},
      {{.max_uA = 80.0, .max_Hz = 500.0, .group = 0},
       {.max_uA = 80.0, .max_Hz = 500.0, .group = 0}});
  limiter.reset(nanoseconds{0});
  std::vector<nanoseconds> kept;
  for (int k = 0; k < 250; ++k) {
    std::vector pulses = {
        pulse_at(k * milliseconds{10} + milliseconds{1}, 80.0, static_cast<std::uint16_t>(k % 2))};
    if (limiter.limit_pulses(pulses, k * milliseconds{10}) == 1) kept.push_back(pulses[0].time);
  }
  ASSERT_EQ(kept.size(), 12U);
  for (std::size_t k = 4; k < kept.size(); ++k) {
    EXPECT_EQ(kept[k] - kept[k - 4], std::chrono::seconds{1});
  }
  EXPECT_EQ(limiter.clippings().group, 250U - 12U);
  // What comes after a reset knows nothing of the seconds before, which may be later ones.
  limiter.reset(nanoseconds{0});
  for (int k = 0; k < 4; ++k) {
    std::vector pulses = {pulse_at(milliseconds{1 + 10 * k}, 80.0, 0)};
    EXPECT_EQ(limiter.limit_pulses(pulses, milliseconds{10 * k}), 1U);
  }
}

TEST(ElectrodeGroups, PulsesWithinTheChargeOfASecondGoOnForLong) {
  // Four of 16 nC a second are all that is allowed, by the charge and by the distance.
  StimulationLimiter limiter(
      {.max_total_uA = 1e6, .groups = {{.gap = milliseconds{250}, .max_charge_nC_per_s = 64.0}}},
      {{.max_uA = 80.0, .max_Hz = 500.0, .group = 0}});
  limiter.reset(nanoseconds{0});
  for (int k = 1; k <= 80; ++k) {
    std::vector pulses = {pulse_at(k * milliseconds{250}, 80.0, 0)};
    EXPECT_EQ(limiter.limit_pulses(pulses, k * milliseconds{250} - kTick), 1U) << k;
  }
  EXPECT_EQ(limiter.clippings().all(), 0U);
}

TEST(ElectrodeGroups, TrainsLeaveRoomForOnePulseOfAGroup) {
  StimulationLimiter limiter({.max_total_uA = 100.0, .groups = {{.gap = milliseconds{1}}}},
                             {{.max_uA = 80.0, .max_Hz = 500.0, .group = 0},
                              {.max_uA = 80.0, .max_Hz = 500.0, .group = 0},
                              {.max_uA = 100.0, .max_Hz = 500.0}});
  limiter.reset(nanoseconds{0});
  for (int k = 0; k < 2; ++k) {
    std::vector pulses = {pulse_at(milliseconds{1 + 2 * k}, 40.0, static_cast<std::uint16_t>(k))};
    ASSERT_EQ(limiter.limit_pulses(pulses, milliseconds{2 * k}), 1U);
  }
  std::vector<StimulationCommand> update(3);
  for (std::uint16_t e = 0; e < 3; ++e) update[e] = {.time = milliseconds{10}, .electrode = e};
  update[2].amplitude_uA = 60.0;
  update[2].frequency_Hz = 100.0;
  limiter.limit_update(update);
  EXPECT_EQ(update[2].amplitude_uA, 60.0);  // 60 µA and one pulse of 40 µA
  EXPECT_EQ(limiter.clippings().total, 0U);
  std::vector next = {pulse_at(milliseconds{12}, 40.0, 0)};
  ASSERT_EQ(limiter.limit_pulses(next, milliseconds{11}), 1U);
  for (StimulationCommand& each : update) each.time = milliseconds{20};
  update[2].amplitude_uA = 70.0;
  limiter.limit_update(update);
  EXPECT_NEAR(update[2].amplitude_uA, 70.0 * 100.0 / 110.0, 1e-9);
  // Without pulses since that update, nothing is kept for them.
  for (StimulationCommand& each : update) each.time = milliseconds{30};
  update[2].amplitude_uA = 100.0;
  limiter.limit_update(update);
  EXPECT_EQ(update[2].amplitude_uA, 100.0);
}

TEST(Encoders, BiomimeticEmphasisesOnsetAndOffset) {
  Electrode electrode = electrode_at("E1", EncoderKind::kBiomimetic, 15.0, 10.0, 3.0);
  electrode.full_force_N = 2.0;
  auto encoder = *StimulationEncoder::create(encoding_of({electrode}), grid_model());
  TickFeed feed(encoder, kTick);
  std::map<std::int64_t, StimulationCommand> at_ms;
  for (int k = 1; k <= 420; ++k) {
    // 0.5 N between 0.1 and 0.3 s, reached and left within 100 ms: 5 N/s.
    const double ramp =
        std::clamp((k - 100) / 100.0, 0.0, 1.0) - std::clamp((k - 300) / 100.0, 0.0, 1.0);
    feed.press = ramp > 0.0 ? press_of(500.0 * ramp) : Press{};
    for (const auto& command : feed.step()) at_ms[command.time / milliseconds{1}] = command;
  }
  const auto expected_uA = [](double force_N, double rate_N_per_s) {
    return 20.0 + 60.0 * (0.3 * force_N / 2.0 + rate_N_per_s / 10.0);
  };
  EXPECT_NEAR(at_ms.at(151).amplitude_uA, expected_uA(0.255, 5.0), 1e-9);
  EXPECT_NEAR(at_ms.at(251).amplitude_uA, expected_uA(0.5, 0.0), 1e-9);
  EXPECT_NEAR(at_ms.at(351).amplitude_uA, expected_uA(0.245, 5.0), 1e-9);
  EXPECT_EQ(at_ms.at(251).frequency_Hz, 200.0);
  EXPECT_EQ(at_ms.at(91).amplitude_uA, 0.0);
  EXPECT_EQ(at_ms.at(91).frequency_Hz, 0.0);
}

TEST(Encoders, LinearAmplitudeKeepsTheStrongestFrequency) {
  Electrode electrode = electrode_at("E1", EncoderKind::kLinearAmplitude, 15.0, 10.0, 3.0);
  electrode.full_force_N = 2.0;
  auto encoder = *StimulationEncoder::create(encoding_of({electrode}), grid_model());
  TickFeed feed(encoder, kTick);
  EXPECT_EQ(feed.step()[0].frequency_Hz, 0.0);
  feed.press = press_of(500.0);
  StimulationCommand last;
  for (int k = 0; k < 10; ++k) {
    for (const auto& command : feed.step()) last = command;
  }
  EXPECT_DOUBLE_EQ(last.amplitude_uA, 35.0);
  EXPECT_EQ(last.frequency_Hz, 200.0);
}

}  // namespace
}  // namespace merkel
