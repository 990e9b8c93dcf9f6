// The encoders against their definitions, computed independently.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "core/encoding/okorokova.hpp"
#include "core/math/random.hpp"
#include "tests/core/encoding/tick_feed.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;

StimulationEncoder encoder_of(const Electrode& electrode,
                              const EncodedModel& model = grid_model()) {
  return *StimulationEncoder::create(encoding_of({electrode}), model);
}

TEST(Okorokova, GivesTheHandComputedValues) {
  // c = 1, 0.8, 0.5, 0.1 mm: v = 0.2, 0.3, 0.4; a = −0.1, −0.1.
  //   557.9706 − 443.8256 + 311.89904 − 107.93301 − 43.64272 + 36.43545 + 16.99743 − 3.1163
  //   181.7049 − 131.36664 + 105.59738 + 87.68148 + 0.63115 + 2.19826 − 2.0783
  const PopulationResponse ramp = okorokova_response({1.0, 0.8, 0.5, 0.1});
  EXPECT_NEAR(ramp.rate_Hz, 324.78489, 1e-9);
  EXPECT_NEAR(ramp.recruited, 244.36823, 1e-9);
  const PopulationResponse step = okorokova_response({1.0, 0.0, 0.0, 0.0});
  EXPECT_NEAR(step.rate_Hz, 2478.7040, 1e-9);   // 557.9706 + 1559.4952 + 364.3545 − 3.1163
  EXPECT_NEAR(step.recruited, 713.9250, 1e-9);  // 181.7049 + 527.9869 + 6.3115 − 2.0783
  const PopulationResponse held = okorokova_response({1.0, 1.0, 1.0, 1.0});
  EXPECT_NEAR(held.rate_Hz, 0.0723, 1e-9);     // 557.9706 − 554.7820 − 3.1163
  EXPECT_NEAR(held.recruited, 15.4183, 1e-9);  // 181.7049 − 164.2083 − 2.0783
  const PopulationResponse release = okorokova_response({0.0, 1.0, 1.0, 1.0});
  EXPECT_NEAR(release.rate_Hz, 1365.9514, 1e-9);   // −554.7820 + 1559.4952 + 364.3545 − 3.1163
  EXPECT_NEAR(release.recruited, 368.0118, 1e-9);  // −164.2083 + 527.9869 + 6.3115 − 2.0783
  // 0.0035 × (181.7049 + 527.9869 + 6.3115) − 2.0783
  EXPECT_NEAR(okorokova_response({0.0035, 0.0, 0.0, 0.0}).recruited, 0.42771, 1e-5);
  EXPECT_EQ(okorokova_response({}).rate_Hz, 0.0);  // −3.1163 is clipped
  EXPECT_EQ(okorokova_response({}).recruited, 0.0);
}

TEST(Okorokova, LooksBack33msAtAnyTick) {
  for (const int tick_us : {250, 1000, 3000}) {
    TouchHistory history{microseconds{tick_us}};
    history.reset(0.0);
    const auto depth_at = [](double t_ms) { return 1.0 + 0.01 * t_ms; };
    for (int k = 1; k * tick_us <= 150'000; ++k) history.push(depth_at(k * tick_us * 1e-3));
    const auto depths = history.at_intervals();
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(depths[static_cast<std::size_t>(k)], depth_at(150.0 - 33.0 * k), 1e-12);
    }
  }
}

TEST(Okorokova, LooksBackByTheNearestNumberOfTicks) {
  TouchHistory history{milliseconds{2}};
  for (int k = 1; k <= 100; ++k) history.push(2.0 * k);
  EXPECT_EQ(history.at_intervals(), (std::array{200.0, 200.0 - 34, 200.0 - 66, 200.0 - 100}));
}

TEST(Encoders, OkorokovaFollowsThePressUnderItsField) {
  Electrode electrode = electrode_at("E1", EncoderKind::kOkorokova, 15.0, 10.0, 3.0);
  StimulationEncoder encoder = encoder_of(electrode);
  TickFeed feed(encoder, kTick);
  std::map<std::int64_t, StimulationCommand> at_ms;
  for (int k = 1; k <= 320; ++k) {
    // 1 mm deep between 0.1 and 0.2 s.
    const double depth_mm = k > 100 && k <= 200 ? 1.0 : 0.0;
    feed.press = {.contact = {.depth_mm = depth_mm}, .x_mm = 15.0, .y_mm = 10.0};
    for (const auto& command : feed.step()) at_ms[command.time / milliseconds{1}] = command;
  }
  const double step_Hz = 200.0 * 2478.7040 / 2500.0;
  EXPECT_NEAR(at_ms.at(111).frequency_Hz, step_Hz, 1e-9);
  EXPECT_NEAR(at_ms.at(131).frequency_Hz, step_Hz, 1e-9);
  EXPECT_EQ(at_ms.at(131).amplitude_uA, 80.0);  // 714 of 700 afferents
  EXPECT_NEAR(at_ms.at(200 + 1).frequency_Hz, 200.0 * 1365.9514 / 2500.0, 1e-9);
  EXPECT_NEAR(at_ms.at(201).amplitude_uA, 20.0 + 60.0 * 368.0118 / 700.0, 1e-9);
  EXPECT_EQ(at_ms.at(91).amplitude_uA, 0.0);
  EXPECT_EQ(at_ms.at(311).amplitude_uA, 0.0);
}

TEST(Encoders, OkorokovaTakesTheDepthByTheWeightOfItsField) {
  Electrode electrode = electrode_at("E1", EncoderKind::kOkorokova, 15.0, 10.0, 3.0);
  electrode.border_mm = 2.0;
  StimulationEncoder encoder = encoder_of(electrode);
  TickFeed feed(encoder, kTick);
  std::vector<StimulationCommand> commands;
  for (int k = 1; k <= 51; ++k) {
    // From 21 ms on 0.8 mm deep, half way into the border.
    feed.press = {.contact = {.depth_mm = k > 20 ? 0.8 : 0.0}, .x_mm = 19.0, .y_mm = 10.0};
    for (const auto& command : feed.step()) commands.push_back(command);
  }
  const PopulationResponse step = okorokova_response({0.4, 0.0, 0.0, 0.0});
  EXPECT_NEAR(commands.back().frequency_Hz, 200.0 * step.rate_Hz / 2500.0, 1e-9);
  EXPECT_NEAR(commands.back().amplitude_uA, 20.0 + 60.0 * step.recruited / 700.0, 1e-9);
}

TEST(Encoders, OkorokovaTakesTheDeepestPressOnItsField) {
  EncodedModel model = grid_model();
  model.patch_of_probe = {0, 0};
  StimulationEncoder encoder =
      encoder_of(electrode_at("E1", EncoderKind::kOkorokova, 15.0, 10.0, 3.0), model);
  const auto press_of = [](double depth_mm) {
    return Press{.contact = {.depth_mm = depth_mm}, .x_mm = 15.0, .y_mm = 10.0};
  };
  const std::vector presses = {press_of(0.8), press_of(0.2)};
  StimulationCommand last;
  for (int k = 1; k <= 51; ++k) {
    const std::vector<TickRecord> records = {{.time = k * kTick, .probe = 0},
                                             {.time = k * kTick, .probe = 1}};
    const std::vector before = {press_of(0.0), press_of(0.0)};
    const auto commands = encoder.step({.records = records, .presses = k > 20 ? presses : before});
    if (!commands.empty()) last = commands[0];
  }
  const PopulationResponse step = okorokova_response({0.8, 0.0, 0.0, 0.0});
  EXPECT_NEAR(last.amplitude_uA, 20.0 + 60.0 * step.recruited / 700.0, 1e-9);
}

/// Random spikes of all afferents of the grid, tick by tick.
std::vector<SpikeEvent> random_spikes(std::uint64_t seed, int ticks, double rate_Hz) {
  Random random(seed);
  std::vector<SpikeEvent> spikes;
  for (int k = 0; k < ticks; ++k) {
    for (std::uint32_t neuron = 1; neuron <= 600; ++neuron) {
      if (random.uniform() > rate_Hz * 1e-3) continue;
      spikes.push_back(
          {.time = k * kTick + nanoseconds{static_cast<std::int64_t>(random.next() % 1'000'000)},
           .neuron = neuron});
    }
  }
  std::sort(spikes.begin(), spikes.end());
  return spikes;
}

/// All commands of an encoder that receives these spikes.
std::vector<StimulationCommand> encode(StimulationEncoder& encoder,
                                       const std::vector<SpikeEvent>& spikes, int ticks) {
  TickFeed feed(encoder, kTick);
  std::vector<StimulationCommand> all;
  auto next = spikes.begin();
  for (int k = 0; k < ticks; ++k) {
    for (; next != spikes.end() && next->time < feed.now() + kTick; ++next) {
      feed.spikes.push_back(*next);
    }
    const auto commands = feed.step();
    all.insert(all.end(), commands.begin(), commands.end());
  }
  return all;
}

bool in_field(std::uint32_t neuron, double x_mm, double y_mm, double radius_mm) {
  const std::uint32_t row = (neuron - 1) / 30;
  return std::hypot((neuron - 1) % 30 + 0.5 - x_mm, row + 0.5 - y_mm) <= radius_mm;
}

TEST(Encoders, RateIsTheConvolutionOfTheSpikes) {
  const auto spikes = random_spikes(7, 400, 40.0);
  Electrode electrode = electrode_at("E1", EncoderKind::kRate, 12.0, 8.0, 2.6);
  electrode.window = milliseconds{25};
  StimulationEncoder encoder = encoder_of(electrode);
  std::size_t afferents = 0;
  for (std::uint32_t n = 1; n <= 600; ++n) afferents += in_field(n, 12.0, 8.0, 2.6) ? 1 : 0;
  ASSERT_EQ(encoder.afferents(0), afferents);
  int updates = 0;
  for (const auto& command : encode(encoder, spikes, 400)) {
    double sum = 0.0;
    for (const SpikeEvent& spike : spikes) {
      if (spike.time > command.time || !in_field(spike.neuron, 12.0, 8.0, 2.6)) continue;
      sum += std::exp(-static_cast<double>((command.time - spike.time).count()) / 25e6) / 0.025;
    }
    const double drive = sum / static_cast<double>(afferents) / 100.0;
    ASSERT_NEAR(command.frequency_Hz, drive < 0.01 ? 0.0 : 200.0 * std::min(1.0, drive), 1e-9);
    ASSERT_NEAR(command.amplitude_uA, drive < 0.01 ? 0.0 : 20.0 + 60.0 * std::min(1.0, drive),
                1e-9);
    ++updates;
  }
  EXPECT_EQ(updates, 40);
}

TEST(Encoders, RecruitedCountsEachAfferentsLastSpike) {
  // Without rescaling, the weights of 1 ms would overflow after 709 windows.
  for (const milliseconds window : {milliseconds{30}, milliseconds{1}}) {
    const auto spikes = random_spikes(8, 1000, 15.0);
    Electrode electrode = electrode_at("E1", EncoderKind::kRecruited, 12.0, 8.0, 2.6);
    electrode.window = window;
    StimulationEncoder encoder = encoder_of(electrode);
    double largest = 0.0;
    for (const auto& command : encode(encoder, spikes, 1000)) {
      std::map<std::uint32_t, nanoseconds> last;
      for (const SpikeEvent& spike : spikes) {
        if (spike.time <= command.time && in_field(spike.neuron, 12.0, 8.0, 2.6)) {
          last[spike.neuron] = spike.time;
        }
      }
      double sum = 0.0;
      for (const auto& [neuron, time] : last) {
        sum += std::exp(-static_cast<double>((command.time - time).count()) /
                        static_cast<double>(nanoseconds(window).count()));
      }
      const double share = sum / static_cast<double>(encoder.afferents(0));
      ASSERT_NEAR(command.frequency_Hz, share < 0.01 ? 0.0 : 200.0 * share, 1e-9);
      if (command.time > milliseconds{800}) largest = std::max(largest, command.frequency_Hz);
    }
    EXPECT_GT(largest, 1.0);
  }
}

TEST(Encoders, RecruitedCountsAnAfferentOnceWhereItsWeightsAreRescaled) {
  // Every 231 ticks of 1 ms with a window of 1 ms; 231 is the tick of an update.
  Electrode electrode = electrode_at("E1", EncoderKind::kRecruited, 12.5, 8.5, 0.4);
  electrode.window = milliseconds{1};
  // Neighbours in memory, which are not rescaled.
  const Electrode before = electrode_at("E2", EncoderKind::kRecruited, 20.5, 8.5, 0.4);
  const Electrode after = electrode_at("E3", EncoderKind::kRecruited, 4.5, 8.5, 0.4);
  StimulationEncoder encoder =
      *StimulationEncoder::create(encoding_of({before, electrode, after}), grid_model());
  for (std::size_t e = 0; e < 3; ++e) ASSERT_EQ(encoder.afferents(e), 1U);
  TickFeed feed(encoder, kTick);
  int updates = 0;
  for (int k = 1; k <= 300; ++k) {
    for (const std::uint32_t column : {5U, 13U, 21U}) {
      feed.spike(microseconds{500}, 8 * 30 + column);
    }
    const auto commands = feed.step();
    if (commands.empty()) continue;
    EXPECT_NEAR(commands[1].amplitude_uA, 20.0 + 60.0 * std::exp(-0.5), 1e-9) << k;
    for (std::size_t e = 0; e < 3; e += 2) {
      EXPECT_NEAR(commands[e].amplitude_uA, 20.0 + 60.0 * std::exp(-0.5 / 30.0), 1e-9) << k;
    }
    ++updates;
  }
  EXPECT_EQ(updates, 30);
}

TEST(Encoders, PulsesAreTheSpikesSubjectToTheFrequency) {
  const auto spikes = random_spikes(9, 500, 12.0);
  Electrode electrode = electrode_at("E1", EncoderKind::kPulsePerSpike, 12.0, 8.0, 2.6);
  StimulationEncoder encoder = encoder_of(electrode);
  std::vector<nanoseconds> expected;
  std::size_t in_all = 0;
  for (const SpikeEvent& spike : spikes) {
    if (!in_field(spike.neuron, 12.0, 8.0, 2.6)) continue;
    ++in_all;
    if (!expected.empty() && spike.time - expected.back() < milliseconds{5}) continue;
    expected.push_back(spike.time);
  }
  std::vector<nanoseconds> pulses;
  for (const auto& command : encode(encoder, spikes, 500)) {
    EXPECT_EQ(command.amplitude_uA, command.kind == Kind::kPulse ? 80.0 : 0.0);
    if (command.kind == Kind::kPulse) pulses.push_back(command.time);
  }
  EXPECT_EQ(pulses, expected);
  EXPECT_GT(expected.size(), 30U);
  EXPECT_EQ(encoder.clippings().frequency, in_all - expected.size());
}

TEST(Encoders, EverySpikeIsAPulseBelowTheFrequency) {
  Electrode electrode = electrode_at("E1", EncoderKind::kPulsePerSpike, 12.5, 8.5, 0.4);
  electrode.frequency_Hz = {0.0, 1000.0};
  StimulationEncoder encoder = encoder_of(electrode);
  ASSERT_EQ(encoder.afferents(0), 1U);
  std::vector<SpikeEvent> spikes;
  for (int k = 0; k < 100; ++k) {
    spikes.push_back({.time = nanoseconds{3'000'001 * std::int64_t{k}}, .neuron = 8 * 30 + 13});
  }
  std::size_t pulses = 0;
  for (const auto& command : encode(encoder, spikes, 300)) {
    if (command.kind != Kind::kPulse) continue;
    EXPECT_EQ(command.time, spikes[pulses++].time);
  }
  EXPECT_EQ(pulses, spikes.size());
}

TEST(Encoders, PulsesHaveRoomBesideAnyOtherElectrode) {
  StimulationEncoder encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kLinear, 12.5, 8.5, 0.4),
                   electrode_at("E2", EncoderKind::kPulsePerSpike, 12.5, 8.5, 0.4)}),
      grid_model());
  const auto commands = encode(encoder, {{.time = milliseconds{3}, .neuron = 8 * 30 + 13}}, 10);
  EXPECT_EQ(std::count_if(commands.begin(), commands.end(),
                          [](const auto& each) { return each.kind == Kind::kPulse; }),
            1);
}

TEST(Encoders, LinearFollowsTheForceOfContactsThatReachTheField) {
  Electrode electrode = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 3.0);
  electrode.full_force_N = 2.0;
  StimulationEncoder encoder = encoder_of(electrode);
  TickFeed feed(encoder, kTick);
  const auto amplitude_uA = [&](double force_mN, double x_mm) {
    feed.press = {.contact = {.depth_mm = 0.5, .force_mN = force_mN, .contact_radius_mm = 1.0},
                  .x_mm = x_mm,
                  .y_mm = 10.0};
    double last = 0.0;
    for (int k = 0; k < 10; ++k) {
      for (const auto& command : feed.step()) last = command.amplitude_uA;
    }
    return last;
  };
  EXPECT_NEAR(amplitude_uA(500.0, 15.0), 35.0, 1e-12);  // a quarter of 2 N
  EXPECT_NEAR(amplitude_uA(500.0, 18.9), 35.0, 1e-12);  // the contact's rim reaches the field
  EXPECT_EQ(amplitude_uA(500.0, 19.1), 0.0);
  EXPECT_EQ(amplitude_uA(5000.0, 15.0), 80.0);
  EXPECT_EQ(encoder.clippings().all(), 0U);  // the encoder itself ends at its range
  EXPECT_EQ(amplitude_uA(HUGE_VAL, 19.1), 0.0);
  EXPECT_EQ(encoder.clippings().all(), 0U);  // outside the field
  EXPECT_EQ(amplitude_uA(HUGE_VAL, 15.0), 0.0);
  EXPECT_EQ(encoder.clippings().invalid, 1U);
}

TEST(Encoders, ATactileArrayHasAForceAndNoDepth) {
  EncodedModel model = grid_model();
  model.patches[0].array = true;
  EXPECT_FALSE(StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kOkorokova, 15.0, 10.0, 3.0)}), model));
  for (const EncoderKind kind : {EncoderKind::kLinear, EncoderKind::kBiomimetic}) {
    StimulationEncoder encoder = encoder_of(electrode_at("E1", kind, 15.0, 10.0, 3.0), model);
    TickFeed feed(encoder, kTick);
    feed.press = {
        .contact = {.force_mN = 800.0, .contact_radius_mm = 4.0, .peak_pressure_kPa = 29.0},
        .x_mm = 15.0,
        .y_mm = 10.0};
    double last_uA = 0.0;
    for (int k = 0; k < 20; ++k) {
      for (const auto& command : feed.step()) last_uA = command.amplitude_uA;
    }
    EXPECT_GT(last_uA, 20.0);
  }
}

TEST(Encoders, AnOwnDriveWithoutAFrequencyIsOff) {
  StimulationEncoder encoder = encoder_of(electrode_at("E1", EncoderKind::kOwn, 15.0, 10.0, 3.0));
  TickFeed feed(encoder, kTick);
  encoder.set_drive({.amplitude = 0.5, .frequency = 0.0});
  encoder.set_drive({.amplitude = 0.5, .frequency = 0.5, .electrode = 65535});  // there is none
  const StimulationCommand off = feed.step()[0];
  EXPECT_EQ(off.amplitude_uA, 0.0);
  EXPECT_EQ(off.frequency_Hz, 0.0);
  EXPECT_EQ(off.stop, StimulationCommand::Stop::kNone);
}

/// The afferent nearest to (15, 10) mm.
constexpr std::uint32_t kMiddle = 9 * 30 + 15;

TEST(Encoders, SpikesOfAnEarlierPressCountAfterItHasSettled) {
  // The press was there before the first tick, which begins at 0.
  const auto amplitude_uA = [](int tick_of_spikes) {
    StimulationEncoder encoder =
        encoder_of(electrode_at("E1", EncoderKind::kRate, 15.0, 10.0, 3.0));
    TickFeed feed(encoder, kTick);
    feed.press = {.contact = {.depth_mm = 0.5}, .x_mm = 15.0, .y_mm = 10.0};
    double last = -1.0;
    for (int k = 1; k <= 51; ++k) {
      for (int n = 0; n < 20 && k == tick_of_spikes; ++n) feed.spike(microseconds{500}, kMiddle);
      for (const auto& command : feed.step()) last = command.amplitude_uA;
    }
    return last;
  };
  EXPECT_EQ(amplitude_uA(50), 0.0);
  EXPECT_GT(amplitude_uA(51), 20.0);
}

TEST(Encoders, AResetForgetsTheSpikesOfEveryElectrode) {
  Electrode rate = electrode_at("E1", EncoderKind::kRate, 15.0, 10.0, 3.0);
  Electrode recruited = electrode_at("E2", EncoderKind::kRecruited, 15.0, 10.0, 1.0);
  Electrode other = electrode_at("E3", EncoderKind::kRate, 15.0, 10.0, 3.0);
  StimulationEncoder encoder =
      *StimulationEncoder::create(encoding_of({rate, recruited, other}), grid_model());
  const auto amplitudes_uA = [&](int spikes) {
    TickFeed feed(encoder, kTick);
    for (int n = 0; n < spikes; ++n) feed.spike(microseconds{500}, kMiddle);
    std::vector<double> all;
    for (const auto& command : feed.step()) all.push_back(command.amplitude_uA);
    return all;
  };
  const auto first = amplitudes_uA(20);
  for (const double each : first) EXPECT_GT(each, 20.0);
  encoder.reset();
  EXPECT_EQ(amplitudes_uA(0), std::vector<double>(3, 0.0));
  encoder.reset();
  amplitudes_uA(20);
  encoder.reset();
  EXPECT_EQ(amplitudes_uA(20), first);
}

}  // namespace
}  // namespace merkel
