#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include <gtest/gtest.h>
#include <malloc.h>

#include "core/math/random.hpp"
#include "core/units.hpp"
#include "drivers/firmware/merkel_probe/pulses.h"
#include "drivers/probes/device_probe.hpp"
#include "drivers/protocols/protocol_table.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr seconds kStart{1000};
constexpr double kDrift = 50e-6;
constexpr milliseconds kBatch{16};  ///< the cable delivers so often
constexpr unsigned kValues = 4096;  ///< a sample's depth is its number modulo this

class VirtualClock final : public HostClock {
 public:
  [[nodiscard]] nanoseconds now() override { return time; }
  void sleep_for(nanoseconds duration) override { time += duration; }
  nanoseconds time{kStart};
};

/// A 1 kHz HBF1 device on a cable that delivers bytes in batches, loses frames, flips bits, and is
/// unplugged every seven minutes for 3 s. The device's clock is 50 ppm fast, and wraps.
class FaultyCable final : public Transport {
 public:
  explicit FaultyCable(VirtualClock& clock)
      : clock_(clock), device_((*find_protocol("hbf1"))->simulate(ProbeSample::kDepth)) {
    info_.name = "virtual";
    device_->boot(device_time(clock_.time), wire_);
  }

  [[nodiscard]] const TransportInfo& info() const noexcept override { return info_; }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds patience) override {
    const nanoseconds until = clock_.time + patience;
    while (arrived_.empty()) {
      if (pulled_out()) return Unexpected<Disconnected>(Disconnected{});
      const nanoseconds next = std::max(next_batch_, clock_.time);
      if (next > until) {
        clock_.time = until;
        return std::size_t{0};
      }
      clock_.time = next;
      measure();
      arrived_.insert(arrived_.end(), wire_.begin(), wire_.end());
      wire_.clear();
      next_batch_ += kBatch;
    }
    const std::size_t count = std::min(bytes.size(), arrived_.size());
    std::copy_n(arrived_.begin(), count, bytes.begin());
    arrived_.erase(arrived_.begin(), arrived_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }

  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    if (pulled_out()) return Unexpected<Disconnected>(Disconnected{});
    measure();
    const bool started = device_->started();
    device_->take(bytes, device_time(clock_.time), wire_);
    // A device measures its first sample when it is started, not when bytes next arrive.
    if (!started) measure();
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    if (pulled_out()) return unavailable("not there");
    measure();
    arrived_.clear();
    next_batch_ = clock_.time + kBatch;
    return {};
  }

  void make_pulses(std::uint32_t seed) { EXPECT_TRUE(device_->set_pulses(seed)); }

  /// Samples measured since the start command.
  std::uint64_t measured = 0;
  std::uint64_t damaged = 0;
  nanoseconds first{0};  ///< host time of the first
  bool faults = true;

 private:
  static nanoseconds device_time(nanoseconds host) {
    // Already on for 40 minutes: the microsecond counter wraps after half an hour.
    const double up_s = units::s_from(host - kStart) * (1.0 + kDrift);
    return minutes{40} + nanoseconds{std::llround(up_s * 1e9)};
  }
  [[nodiscard]] bool pulled_out_at(nanoseconds time) const {
    constexpr seconds kEvery{420};
    return faults && (time - kStart) % kEvery > kEvery - seconds{3};
  }
  [[nodiscard]] bool pulled_out() const { return pulled_out_at(clock_.time); }

  /// Measures up to now; samples are lost while unplugged.
  void measure() {
    if (!device_->started()) return;
    if (measured == 0) first = clock_.time;
    while (first + milliseconds{measured} <= clock_.time) {
      const nanoseconds due = first + milliseconds{measured};
      ProbeSample sample{.channels = ProbeSample::kDepth};
      sample.depth_mm = static_cast<double>(measured % kValues) / 1024.0;
      Bytes frame;
      device_->measure(sample, {}, device_time(due), frame);
      ++measured;
      if (pulled_out_at(due) || (faults && random_.uniform() < 1e-3)) continue;
      if (faults && random_.uniform() < 1e-3) {
        std::uint8_t& byte = frame[1 + random_.next() % (frame.size() - 2)];
        const auto flipped = static_cast<std::uint8_t>(byte ^ (1U << random_.next() % 8U));
        if (flipped != 0) {  // otherwise one flip would break two frames
          byte = flipped;
          ++damaged;
        }
      }
      wire_.insert(wire_.end(), frame.begin(), frame.end());
    }
  }

  VirtualClock& clock_;
  std::unique_ptr<SimulatedDevice> device_;
  TransportInfo info_;
  Random random_{11};
  nanoseconds next_batch_{kStart};
  Bytes wire_;
  std::deque<std::uint8_t> arrived_;
};

struct Errors {
  double sum_us = 0.0;
  double squares = 0.0;
  double count = 0.0;

  void add(double us) {
    sum_us += us;
    squares += us * us;
    ++count;
  }
  [[nodiscard]] double mean_us() const { return sum_us / count; }
  [[nodiscard]] double rms_us() const {
    return std::sqrt(std::max(squares / count - mean_us() * mean_us(), 0.0));
  }
};

TEST(DeviceHour, EveryLostSampleIsCountedTimesDoNotDriftAndMemoryIsFlat) {
  VirtualClock clock;
  auto owned = std::make_unique<FaultyCable>(clock);
  FaultyCable& cable = *owned;
  const auto uri = Uri::parse("serial:virtual");
  UriOptions none(*uri);
  auto opened = DeviceProbe::open(std::move(owned), *(*find_protocol("hbf1"))->make(none),
                                  {.uri = "serial:virtual", .protocol = "hbf1", .clock = &clock});
  ASSERT_TRUE(opened.has_value()) << opened.error().sentence;
  Probe& probe = **opened;

  std::uint64_t heard = 0;
  std::uint64_t last = 0;
  std::uint64_t wrong = 0;
  Errors after_settling;
  Errors at_the_end;
  std::size_t memory = 0;
  std::vector<ProbeSample> samples(256);
  while (clock.time < kStart + minutes{60}) {
    if (clock.time > kStart + minutes{60} - seconds{1})
      cable.faults = false;  // receive the last sample
    const auto count = probe.read(samples, milliseconds{100});
    ASSERT_TRUE(count.has_value());
    static_cast<void>(probe.take_notices());
    for (std::size_t i = 0; i < *count; ++i) {
      const ProbeSample& sample = samples[i];
      ++heard;
      last = sample.sequence;
      if (sample.depth_mm != static_cast<double>(last % kValues) / 1024.0) ++wrong;
      const nanoseconds truth = cable.first + milliseconds{last};
      const double error_us = 1e6 * units::s_from(sample.time - truth);
      if (truth > kStart + minutes{2} && truth < kStart + minutes{12}) after_settling.add(error_us);
      if (truth > kStart + minutes{50}) at_the_end.add(error_us);
    }
    if (memory == 0 && clock.time > kStart + minutes{5}) memory = ::mallinfo2().uordblks;
  }
  const DeviceCounts counts = *probe.device_counts();
  EXPECT_GT(heard, 3'500'000U);
  EXPECT_EQ(wrong, 0U);  // every sample has its original number
  EXPECT_EQ(counts.readings, heard);
  EXPECT_EQ(counts.lost, last + 1 - heard);
  EXPECT_LE(cable.measured - (last + 1), 16U);  // still in transit
  EXPECT_EQ(counts.damaged, cable.damaged);
  EXPECT_GT(counts.damaged, 3000U);
  EXPECT_EQ(counts.outages, 8U);
  EXPECT_EQ(counts.reboots, 0U);
  EXPECT_EQ(counts.refused, 0U);
  EXPECT_LT(after_settling.rms_us(), 10.0);
  EXPECT_LT(at_the_end.rms_us(), 10.0);
  EXPECT_NEAR(at_the_end.mean_us(), after_settling.mean_us(), 20.0);
  EXPECT_NEAR(counts.drift_ppm, 50.0, 1.0);
  EXPECT_LT(static_cast<double>(::mallinfo2().uordblks), static_cast<double>(memory) + 65536.0);
}

TEST(DeviceHour, SamplesThatWaitedForAStoppedHostAreNoBursts) {
  VirtualClock clock;
  auto owned = std::make_unique<FaultyCable>(clock);
  owned->faults = false;
  const auto uri = Uri::parse("serial:virtual");
  UriOptions none(*uri);
  auto opened = DeviceProbe::open(std::move(owned), *(*find_protocol("hbf1"))->make(none),
                                  {.uri = "serial:virtual", .protocol = "hbf1", .clock = &clock});
  ASSERT_TRUE(opened.has_value()) << opened.error().sentence;
  std::vector<ProbeSample> samples(256);
  const auto read_until = [&](nanoseconds end) {
    while (clock.time < end) ASSERT_TRUE((*opened)->read(samples, milliseconds{100}));
  };
  read_until(kStart + seconds{4});
  clock.time += seconds{3};
  read_until(kStart + seconds{9});
  const DeviceCounts counts = *(*opened)->device_counts();
  EXPECT_GT(counts.readings, 8000U);
  EXPECT_LT(counts.age_ms, units::ms_from(kBatch));
}

TEST(DeviceHour, EdgesThatADeviceReportsWithItsOwnTimeAreOnTheHostsClock) {
  constexpr std::uint32_t kSeed = 7;
  VirtualClock clock;
  auto owned = std::make_unique<FaultyCable>(clock);
  FaultyCable& cable = *owned;
  cable.faults = false;
  cable.make_pulses(kSeed);
  const auto uri = Uri::parse("serial:virtual");
  UriOptions none(*uri);
  auto opened = DeviceProbe::open(std::move(owned), *(*find_protocol("hbf1"))->make(none),
                                  {.uri = "serial:virtual", .protocol = "hbf1", .clock = &clock});
  ASSERT_TRUE(opened.has_value()) << opened.error().sentence;
  std::vector<SyncEdge> edges;
  std::map<nanoseconds, double> sample_errors_us;  ///< by the true time
  Readings readings = (*opened)->readings(256);
  while (clock.time < kStart + minutes{10}) {
    const auto count = (*opened)->read(readings, milliseconds{100});
    ASSERT_TRUE(count.has_value());
    for (std::size_t i = 0; i < *count; ++i) {
      const auto sample = readings.sample(i);
      ASSERT_TRUE(sample);
      const nanoseconds truth = cable.first + milliseconds{sample->sequence};
      sample_errors_us[truth] = 1e6 * units::s_from(sample->time - truth);
    }
    edges.insert(edges.end(), readings.edges().begin(), readings.edges().end());
  }
  hbf1::Pulses pulses(kSeed);
  // The device begins when it is started, at the time of its first sample.
  nanoseconds device{0};
  std::size_t compared = 0;
  for (const SyncEdge& edge : edges) {
    const nanoseconds next = microseconds{pulses.next_us()};
    EXPECT_EQ(edge.line, 1U);
    EXPECT_EQ(edge.level, pulses.high() ? 1U : 0U);
    const nanoseconds truth =
        cable.first +
        nanoseconds{std::llround(static_cast<double>(device.count()) / (1.0 + kDrift))};
    device += next;
    const auto sample = sample_errors_us.lower_bound(truth);
    if (truth < kStart + minutes{2} || sample == sample_errors_us.end()) continue;
    // As far from the truth as the samples, half of a round trip of this cable at most; but never
    // later than it arrived.
    const nanoseconds on_the_way = kBatch - (truth - kStart) % kBatch;
    const double error_us = 1e6 * units::s_from(edge.time - truth);
    EXPECT_LT(std::fabs(error_us), 1000.0);
    EXPECT_NEAR(error_us, std::min(sample->second, 1e6 * units::s_from(on_the_way)), 10.0)
        << units::s_from(truth);
    ++compared;
  }
  EXPECT_GT(compared, 2500U);  // about 6.8 a second
}

}  // namespace
}  // namespace merkel
