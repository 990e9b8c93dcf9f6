#include "drivers/protocols/protocol_table.hpp"

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/parameters/range.hpp"
#include "core/units.hpp"
#include "tests/drivers/protocols/protocol_harness.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::uint32_t kAllChannels =
    ProbeSample::kDepth | ProbeSample::kForce | ProbeSample::kX | ProbeSample::kY;

/// A press with values that every device can represent exactly.
ProbeSample press(Random& random, nanoseconds time) {
  const auto eighths = [&](double most) { return std::floor(random.uniform() * most * 8.0) / 8.0; };
  ProbeSample sample{.time = time, .channels = kAllChannels};
  sample.depth_mm = eighths(4.0);
  sample.force_mN = units::mN_from_N(eighths(8.0));
  sample.x_mm = eighths(30.0);
  sample.y_mm = eighths(20.0);
  return sample;
}

/// The output of a simulated device for a press of `count` samples, 1 ms apart, with the protocol
/// at the other end.
struct Session {
  Session(std::string_view name, int count) : talk(name), device(simulate(name)) {
    Random random(7);
    device->boot(talk.now, wire);
    exchange();
    talk.protocol->start(talk.now, talk.stream);
    for (int k = 0; k < count; ++k) {
      talk.now += milliseconds{1};
      samples.push_back(press(random, talk.now));
      // A gauge that streams 250 readings per second makes one every 4 ms.
      const auto period = device->period();
      if (!period || talk.now.count() % period->count() == 0) {
        device->measure(samples.back(), {}, talk.now, wire);
      }
      exchange();
      if (!device->started()) samples.pop_back();
    }
  }
  static std::unique_ptr<SimulatedDevice> simulate(std::string_view name) {
    return (*find_protocol(name))->simulate(kAllChannels);
  }
  /// Exchanges bytes until both sides are idle.
  void exchange() {
    for (int turn = 0; turn < 4; ++turn) {
      static_cast<void>(talk.protocol->poll(talk.now, talk.stream));
      device->take(std::exchange(talk.stream.outgoing, {}), talk.now, wire);
      sent.insert(sent.end(), wire.begin(), wire.end());
      talk.take(std::exchange(wire, {}));
    }
  }

  Talk talk;
  std::unique_ptr<SimulatedDevice> device;
  Bytes wire;
  Bytes sent;
  std::vector<ProbeSample> samples;
};

class EveryProtocol : public testing::TestWithParam<std::string_view> {};

TEST_P(EveryProtocol, GivesBackWhatItsSimulatedDeviceMeasures) {
  const Session session(GetParam(), 3000);
  const auto& stream = session.talk.stream;
  EXPECT_EQ(stream.counts.damaged, 0U);
  EXPECT_EQ(stream.counts.lost, 0U);
  EXPECT_EQ(stream.counts.refused, 0U);
  EXPECT_EQ(stream.counts.reboots, 0U);
  ASSERT_GT(stream.readings.size(), 30U);
  std::size_t compared = 0;
  for (const DeviceReading& reading : stream.readings) {
    // Polled devices skip samples: find the current one.
    const auto index = (reading.arrival - session.samples.front().time) / milliseconds{1};
    if (index < 1) continue;  // before the first sample a device reports 0
    const ProbeSample& sample = session.samples[static_cast<std::size_t>(index)];
    const auto same = [&](DeviceChannel channel, double value) {
      if (reading.has(channel)) {
        EXPECT_NEAR(reading[channel], value, 1e-12);
        ++compared;
      }
    };
    same(DeviceChannel::kForce, units::N_from_mN(sample.force_mN));
    same(DeviceChannel::kForceZ, units::N_from_mN(sample.force_mN));
    same(DeviceChannel::kDepth, sample.depth_mm);
    same(DeviceChannel::kX, sample.x_mm);
    same(DeviceChannel::kY, sample.y_mm);
    same(DeviceChannel::kZ, -sample.depth_mm);
  }
  EXPECT_GT(compared, 30U);
}

TEST(CsvDevice, ItsUriNamesEachQuantityOnce) {
  const auto entry = find_protocol("csv");
  ASSERT_TRUE(entry);
  const auto device = (*entry)->simulate(ProbeSample::kDepth);
  ASSERT_TRUE(device->set_columns({"time_ms", "seq", "depth_um", "thumb_N", "thumb_g", "note"}));
  EXPECT_EQ(device->uri_options(), "columns=time_us,seq,depth_mm,-,-,-,thumb_N,-,-");
  Talk talk("csv", device->uri_options());
  Bytes wire;
  device->boot(talk.now, wire);
  const std::vector<double> others = {7.0, 9.0, 4e3, 0.25, 99.0, 1.0};
  for (int i = 1; i < 4; ++i) {
    device->measure({.depth_mm = 1.5, .channels = ProbeSample::kDepth}, others, milliseconds{i},
                    wire);
  }
  talk.take(wire);
  ASSERT_EQ(talk.stream.readings.size(), 3U);
  EXPECT_EQ(talk.stream.readings[0][DeviceChannel::kDepth], 1.5);
  EXPECT_EQ(talk.stream.readings[0][named_channel(0)], 0.25);
  EXPECT_EQ(talk.stream.readings[0].device_time, milliseconds{1});
}

/// Forces and depths of every size that a finger meets, and noise about 0, as a real sensor has.
ProbeSample touch_of_any_size(Random& random, nanoseconds time) {
  const auto any_size = [&](double most) {
    const double value = most * std::pow(10.0, -9.0 * random.uniform());
    return random.uniform() < 0.3 ? -1e-3 * value : value;
  };
  ProbeSample sample{.time = time, .channels = kAllChannels};
  sample.depth_mm = any_size(12.0);
  sample.force_mN = units::mN_from_N(any_size(20.0));
  sample.x_mm = 30.0 * random.uniform();
  sample.y_mm = 20.0 * random.uniform();
  return sample;
}

/// Takes what a simulated device prints at a rate to its parser, for two seconds.
void expect_nothing_lost(std::string_view name, double rate_Hz) {
  const auto entry = find_protocol(name);
  ASSERT_TRUE(entry);
  const auto device = (*entry)->simulate(kAllChannels);
  device->set_rate(rate_Hz);
  const std::string own = device->uri_options();
  Talk talk(name, (own.empty() ? std::string((*entry)->options) : own) +
                      (own.empty() && (*entry)->options.empty() ? "" : "&") +
                      "rate_hz=" + shortest_decimal(rate_Hz));
  Random random(static_cast<std::uint64_t>(rate_Hz));
  Bytes wire;
  device->boot(talk.now, wire);
  const auto exchange = [&] {
    for (int turn = 0; turn < 4; ++turn) {
      static_cast<void>(talk.protocol->poll(talk.now, talk.stream));
      device->take(std::exchange(talk.stream.outgoing, {}), talk.now, wire);
      talk.take(std::exchange(wire, {}));
    }
  };
  exchange();
  talk.protocol->start(talk.now, talk.stream);
  exchange();
  const nanoseconds period = device->period().value_or(units::nanoseconds_from_s(1.0 / rate_Hz));
  const nanoseconds end = talk.now + std::chrono::seconds{2};
  const std::uint64_t before = talk.stream.counts.readings;
  std::uint64_t measured = 0;
  for (nanoseconds next = talk.now + period; talk.now < end; talk.now += microseconds{500}) {
    for (; next <= talk.now; next += period) {
      device->measure(touch_of_any_size(random, next), {}, next, wire);
      ++measured;
    }
    exchange();
  }
  const ProtocolCounts& counts = talk.stream.counts;
  EXPECT_EQ(counts.damaged, 0U) << rate_Hz;
  EXPECT_EQ(counts.lost, 0U) << rate_Hz;
  EXPECT_EQ(counts.refused, 0U) << rate_Hz;
  EXPECT_EQ(counts.duplicates, 0U) << rate_Hz;
  const std::uint64_t readings = counts.readings - before;
  // A device that is asked answers as often as the host asks.
  if ((*entry)->only_answers) {
    EXPECT_GE(static_cast<double>(readings), 0.9 * 2.0 * rate_Hz - 2.0) << rate_Hz;
  } else {
    // The beginning of a gauge's first line may be missing: it is left out.
    EXPECT_EQ(readings + (name == "mark10" ? 1 : 0), measured) << rate_Hz;
  }
}

TEST_P(EveryProtocol, TakesWhatItsSimulatedDevicePrintsAtEachRate) {
  for (const double rate_Hz : {10.0, 25.0, 100.0, 250.0, 1000.0}) {
    const bool in_fives = rate_Hz == 100.0 || rate_Hz == 1000.0;
    const double most = GetParam() == "esm"     ? 50.0
                        : GetParam() == "grbl"  ? 100.0
                        : GetParam() == "zaber" ? 200.0
                                                : 1000.0;
    // Rates that a device does not offer.
    if ((GetParam() == "mark10" && in_fives) || rate_Hz > most) continue;
    expect_nothing_lost(GetParam(), rate_Hz);
  }
}

TEST(AtiRdtDevice, PrintsWhatItsParserTakesAtEachRate) {
  for (const double rate_Hz : {10.0, 25.0, 100.0, 250.0, 1000.0}) {
    expect_nothing_lost("ati_rdt", rate_Hz);
  }
}

TEST_P(EveryProtocol, PortionsOfBytesDoNotMatter) {
  const Session session(GetParam(), 500);
  const auto readings_in = [&](std::size_t portion) {
    Talk talk(GetParam());
    static_cast<void>(talk.poll());
    const auto bytes = std::span<const std::uint8_t>(session.sent);
    for (std::size_t at = 0; at < bytes.size(); at += portion) {
      talk.take(bytes.subspan(at, std::min(portion, bytes.size() - at)));
      static_cast<void>(talk.poll());
    }
    return std::pair(talk.stream.counts.readings, talk.stream.counts.damaged);
  };
  const auto whole = readings_in(session.sent.size());
  EXPECT_EQ(whole, readings_in(1));
  EXPECT_EQ(whole, readings_in(7));
  EXPECT_EQ(whole, readings_in(61));
}

TEST_P(EveryProtocol, NeverGivesAnImpossibleReadingWhateverComes) {
  const Session session(GetParam(), 400);
  Random random(11);
  const auto below = [&](std::size_t limit) {
    return static_cast<std::size_t>(random.uniform() * static_cast<double>(limit));
  };
  std::uint64_t readings = 0;
  for (int round = 0; round < 60; ++round) {
    Talk talk(GetParam());
    Bytes bytes = session.sent;
    for (std::size_t faults = below(200); faults > 0; --faults) {
      const std::size_t at = below(bytes.size());
      const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      switch (below(4)) {
        case 0:
          *place = static_cast<std::uint8_t>(below(256));
          break;
        case 1:
          bytes.erase(place);
          break;
        case 2:
          bytes.insert(place, static_cast<std::uint8_t>("nainfe+-.9"[below(10)]));
          break;
        default:
          bytes.insert(place, below(40), static_cast<std::uint8_t>(below(256)));
      }
    }
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t portion = std::min(bytes.size() - at, 1 + below(100));
      talk.now += milliseconds{static_cast<std::int64_t>(below(60))};
      static_cast<void>(talk.poll());
      talk.take(std::span<const std::uint8_t>(bytes).subspan(at, portion));
      at += portion;
    }
    for (const DeviceReading& reading : talk.stream.readings) ASSERT_TRUE(plausible(reading));
    readings += talk.stream.readings.size();
  }
  EXPECT_GT(readings, 0U);
}

TEST_P(EveryProtocol, IsRecognisedByItsBytes) {
  const Session session(GetParam(), 500);
  const std::string_view likely = likely_protocol(session.sent);
  EXPECT_EQ(likely, GetParam());
}

std::vector<std::string_view> names() {
  std::vector<std::string_view> names;
  for (const ProtocolEntry& entry : protocol_table()) names.push_back(entry.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Protocols, EveryProtocol, testing::ValuesIn(names()),
                         [](const auto& entry) { return std::string(entry.param); });

TEST(ProtocolTable, NoiseIsNoProtocol) {
  Random random(3);
  Bytes noise(4096);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.uniform() * 256.0);
  EXPECT_EQ(likely_protocol(noise), "");
  EXPECT_EQ(likely_protocol({}), "");
}

TEST(ProtocolTable, AWrongNameGetsASuggestion) {
  EXPECT_NE(find_protocol("mark-10").error().sentence.find("did you mean mark10"),
            std::string::npos);
  EXPECT_NE(find_protocol("").error().sentence.find("hbf1"), std::string::npos);
}

}  // namespace
}  // namespace merkel
