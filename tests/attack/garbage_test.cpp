// Garbage is not touch: noise, a wrong baud rate and damage on the line of every protocol.
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "drivers/protocols/hbf1_frame.hpp"
#include "tests/attack/noisy_line.hpp"

namespace merkel {
namespace {

class Garbage : public testing::TestWithParam<std::string_view> {};

/// Bytes of each millisecond of noise at full speed.
NoisyLine::Change noise(std::uint64_t seed, std::size_t bytes) {
  return [random = Random(seed), bytes](const Bytes&) mutable {
    Bytes heard(bytes);
    for (auto& byte : heard) byte = static_cast<std::uint8_t>(random.next() >> 24U);
    return heard;
  };
}

/// Text of the characters of numbers: the noise that parses most often.
NoisyLine::Change digits(std::uint64_t seed) {
  return [random = Random(seed)](const Bytes&) mutable {
    constexpr std::string_view kCharacters = "0123456789.,;- \t\r\nNmxyzE+/:|<>@!";
    Bytes heard(12);
    for (auto& byte : heard) {
      byte = static_cast<std::uint8_t>(kCharacters[random.next() % kCharacters.size()]);
    }
    return heard;
  };
}

/// Samples in the garbage after its first 100 ms, and touch before and after.
void expect_release(std::string_view protocol, const NoisyLine::Change& change,
                    std::string_view name) {
  NoisyProbe device(protocol);
  ASSERT_NE(device.probe, nullptr) << device.error;
  EXPECT_GT(device.read_for(1.0).size(), 20U) << name;
  device.line->change = change;
  static_cast<void>(device.read_for(0.5));
  const std::size_t touch = device.read_for(4.5).size();
  EXPECT_LE(touch, 4U) << name;  // of a thousand
  const DeviceCounts counts = *device.probe->device_counts();
  if (counts.withheld > 0) {
    EXPECT_TRUE(device.was_told("of what it sends is damaged")) << name;
    EXPECT_GE(counts.distrusted, 1U) << name;
  }
  device.line->change = {};
  static_cast<void>(device.read_for(3.0));
  EXPECT_GT(device.read_for(1.0).size(), 20U) << name;
}

TEST_P(Garbage, NoiseReleasesThePressAndTouchResumes) {
  expect_release(GetParam(), noise(1, 12), "slow noise");
  expect_release(GetParam(), noise(2, 1000), "fast noise");
}

TEST_P(Garbage, NoiseOfDigitsReleasesThePress) { expect_release(GetParam(), digits(3), "digits"); }

TEST_P(Garbage, AWrongBaudRateReleasesThePress) {
  const double own = (*find_protocol(GetParam()))->baud;
  for (const double received :
       {0.25 * own, 0.5 * own, 0.9 * own, 1.1 * own, 2.0 * own, 4.0 * own}) {
    expect_release(
        GetParam(), [=](const Bytes& sent) { return at_another_baud(sent, own, received); },
        std::to_string(received) + " Bd");
  }
}

TEST_P(Garbage, LittleDamageCostsItsFramesOnly) {
  NoisyProbe device(GetParam());
  ASSERT_NE(device.probe, nullptr) << device.error;
  const auto clean = device.read_for(5.0).size();
  Random random(5);
  device.line->change = [&](Bytes sent) {
    if (!sent.empty() && random.uniform() < 0.05) sent[random.next() % sent.size()] ^= 0x40U;
    return sent;
  };
  const auto damaged = device.read_for(5.0).size();
  EXPECT_GT(static_cast<double>(damaged), 0.5 * static_cast<double>(clean));
  EXPECT_EQ(device.probe->device_counts()->distrusted, 0U);
}

/// How many ticks of a held press have no sample in the last 50 ms.
double touch_lost(std::string_view protocol, std::string_view options,
                  const NoisyLine::Change& change) {
  NoisyProbe device(protocol, options, change);
  if (!device.probe) return 1.0;
  static_cast<void>(device.read_for(2.0));
  const auto samples = device.read_for(8.0);
  std::chrono::nanoseconds lost{0};
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const auto gap = samples[i].time - samples[i - 1].time;
    if (gap > std::chrono::milliseconds{50}) lost += gap;
    EXPECT_LT(samples[i].arrival - samples[i].time, std::chrono::milliseconds{100});
  }
  return samples.size() < 1000 ? 1.0 : units::s_from(lost) / 8.0;
}

/// Lines of time and force, with the time that a test wants for each.
NoisyLine::Change lines_with_time(std::function<std::string(double seconds)> time) {
  return [time = std::move(time), ms = 0](const Bytes&) mutable {
    const std::string line = time(1e-3 * ++ms) + ",1.0\r\n";
    return Bytes(line.begin(), line.end());
  };
}

TEST(WrongTimes, CannotSilenceTouch) {
  const auto number = [](double value) { return std::to_string(value); };
  const std::vector<std::pair<std::string, std::function<std::string(double)>>> clocks = {
      {"right", [&](double s) { return number(s); }},
      {"100 years ahead from 4 s on",
       [&](double s) { return number(s + (s > 4.0 ? 3.2e9 : 0.0)); }},
      {"100 years after now", [&](double s) { return number(s + (s > 4.0 ? 4.9e9 : 0.0)); }},
      {"40 digits", [&](double s) { return number(s) + (s > 4.0 ? "" : std::string(40, '1')); }},
      {"40 digits before the point", [&](double s) { return std::string(40, '1') + number(s); }},
      {"negative", [&](double s) { return number(-s); }},
      {"from negative to positive", [&](double s) { return number(s - 5.0); }},
      {"frozen", [&](double s) { return number(std::min(s, 3.0)); }},
      {"a unit that changes", [&](double s) { return number(s < 4.0 ? s : 1000.0 * s); }},
      {"and back", [&](double s) { return number(s < 4.0 || s > 7.0 ? s : 1e6 * s); }},
      {"-372 times", [&](double s) { return number(-372.0 * s); }},
      {"1e15 times", [&](double s) { return number(1e15 * s); }},
      {"sawtooth", [&](double s) { return number(std::fmod(s, 0.05)); }},
  };
  for (const auto& [name, clock] : clocks) {
    EXPECT_LT(touch_lost("csv", "columns=time_s,force_N", lines_with_time(clock)), 0.05) << name;
  }
}

/// HBF1 samples whose headers a test changes.
NoisyLine::Change with_headers(std::function<void(Hbf1Header&, double seconds)> edit) {
  return [edit = std::move(edit), decoder = Hbf1Decoder(), ms = 0](const Bytes& sent) mutable {
    ++ms;
    Bytes heard;
    for (const std::uint8_t byte : sent) {
      const auto frame = decoder.take(byte);
      if (!frame) continue;
      Hbf1Header header = frame->header;
      edit(header, 1e-3 * ms);
      append_hbf1_frame(header, frame->body, heard);
    }
    return heard;
  };
}

TEST(WrongTimes, OfHbf1CannotSilenceTouchEither) {
  Random random(3);
  const std::vector<std::pair<std::string, std::function<void(Hbf1Header&, double)>>> faults = {
      {"none", [](Hbf1Header&, double) {}},
      {"random numbers",
       [&](Hbf1Header& header, double) {
         header.sequence = static_cast<std::uint16_t>(random.next());
       }},
      {"-372 times",
       [](Hbf1Header& header, double s) {
         header.time_us = static_cast<std::uint32_t>(static_cast<std::int64_t>(-372e6 * s));
       }},
      {"random times", [&](Hbf1Header& header,
                           double) { header.time_us = static_cast<std::uint32_t>(random.next()); }},
      {"-372 times and random numbers",
       [&](Hbf1Header& header, double s) {
         header.time_us = static_cast<std::uint32_t>(static_cast<std::int64_t>(-372e6 * s));
         header.sequence = static_cast<std::uint16_t>(random.next());
       }},
      {"random times and numbers",
       [&](Hbf1Header& header, double) {
         header.time_us = static_cast<std::uint32_t>(random.next());
         header.sequence = static_cast<std::uint16_t>(random.next());
       }},
      {"frozen", [](Hbf1Header& header, double) { header.time_us = 7; }},
  };
  for (const auto& [name, edit] : faults) {
    EXPECT_LT(touch_lost("hbf1", "", with_headers(edit)), 0.03) << name;
  }
}

/// The bytes of 1.8 s at once: a device that waits for a core, or boots, while it is asked.
NoisyLine::Change delayed(NoisyLine::Change change) {
  return [change = std::move(change), held = Bytes(), ms = 0](const Bytes& sent) mutable {
    held.insert(held.end(), sent.begin(), sent.end());
    return ++ms < 1800 ? Bytes() : change(std::exchange(held, {}));
  };
}

TEST(Opening, OfADeviceThatSaidHelloEndsWhateverPrecedesIt) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    NoisyProbe device("hbf1", "", delayed(with_headers([&](Hbf1Header& header, double) {
                        header.sequence = static_cast<std::uint16_t>(random.next());
                      })));
    ASSERT_NE(device.probe, nullptr) << seed << ": " << device.error;
    EXPECT_GT(device.read_for(1.0).size(), 100U) << seed;
  }
  const auto boot_noise = [ms = 0](Bytes sent) mutable {
    for (const std::uint8_t byte : Bytes{0x55, 0x33, 0x00}) {
      if (ms < 20) sent.insert(sent.begin(), byte);
    }
    ++ms;
    return sent;
  };
  NoisyProbe device("hbf1", "", boot_noise);
  ASSERT_NE(device.probe, nullptr) << device.error;
  EXPECT_GT(device.read_for(1.0).size(), 240U);
  EXPECT_EQ(device.probe->device_counts()->distrusted, 0U);
}

/// Share of bad frames while a change is applied, in percent; empty if nothing forms a frame.
std::optional<double> bad_percent(std::string_view protocol, const NoisyLine::Change& change) {
  NoisyProbe device(protocol);
  static_cast<void>(device.read_for(1.0));
  const DeviceCounts before = *device.probe->device_counts();
  device.line->change = change;
  static_cast<void>(device.read_for(5.0));
  const DeviceCounts after = *device.probe->device_counts();
  const auto bad = static_cast<double>(after.damaged + after.refused + after.reordered -
                                       before.damaged - before.refused - before.reordered);
  const auto good = static_cast<double>(after.readings + after.withheld - before.readings);
  if (bad + good < 8.0) return std::nullopt;
  return 100.0 * bad / (bad + good);
}

// The measurement behind the default of bad_share.
TEST(BadShare, SeparatesGarbageFromALineWithMuchDamage) {
  std::printf("| protocol | a flipped bit in 5 %% of transfers | wrong baud rates | noise |\n");
  std::printf("|---|---|---|---|\n");
  for (const ProtocolEntry& entry : protocol_table()) {
    Random random(5);
    const auto flip = [&](Bytes sent) {
      if (!sent.empty() && random.uniform() < 0.05) sent[random.next() % sent.size()] ^= 0x40U;
      return sent;
    };
    const double damaged = bad_percent(entry.name, flip).value_or(0.0);
    double least = 100.0;
    const double own = entry.baud;
    for (const double factor : {0.25, 0.5, 0.9, 1.1, 2.0, 4.0}) {
      const auto wrong_baud = [=](const Bytes& sent) {
        return at_another_baud(sent, own, factor * own);
      };
      least = std::min(least, bad_percent(entry.name, wrong_baud).value_or(100.0));
    }
    double noisy = 100.0;
    for (const auto& change : {noise(1, 12), noise(2, 1000), digits(3)}) {
      noisy = std::min(noisy, bad_percent(entry.name, change).value_or(100.0));
    }
    std::printf("| %s | %.0f %% | at least %.0f %% | at least %.0f %% |\n",
                std::string(entry.name).c_str(), damaged, least, noisy);
    EXPECT_LT(damaged, 25.0) << entry.name;
    EXPECT_GT(least, 50.0) << entry.name;
    EXPECT_GT(noisy, 50.0) << entry.name;
  }
}

std::vector<std::string_view> garbage_protocols() {
  std::vector<std::string_view> names;
  for (const ProtocolEntry& entry : protocol_table()) names.push_back(entry.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Protocols, Garbage, testing::ValuesIn(garbage_protocols()),
                         [](const auto& entry) { return std::string(entry.param); });

}  // namespace
}  // namespace merkel
