#include "drivers/clock/device_clock.hpp"

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr double kDrift = 50e-6;

/// A 1 kHz device whose clock is 50 ppm fast, and a transport that delays. Host time starts at
/// 1000 s, the device's at 123.4 s.
struct Device {
  explicit Device(std::uint64_t seed) : random(seed) {}

  [[nodiscard]] static nanoseconds clock(double t_s) {
    const double wander = 2e-6 * std::min(t_s, 180.0) * std::sin(t_s / 40.0);
    const double device_s = 123.4 + t_s * (1.0 + kDrift) + wander;
    return microseconds{static_cast<std::int64_t>(device_s * 1e6)};
  }
  [[nodiscard]] static nanoseconds host(double t_s) {
    return seconds{1000} + nanoseconds{static_cast<std::int64_t>(t_s * 1e9)};
  }
  double exponential(double mean) { return -mean * std::log(1.0 - random.uniform()); }

  /// The arrival of bytes sent at a time; never before earlier bytes.
  double arrival(double t_s, bool batched) {
    double arrival = t_s + 0.0002 + exponential(0.0003);
    if (batched) {
      arrival = std::ceil(arrival / 0.016) * 0.016 + 0.0001 * random.uniform();
    } else {
      arrival = std::ceil(arrival / 0.001) * 0.001;
    }
    if (random.uniform() < 0.001) arrival += 0.02 * random.uniform();
    return last = std::max(last, arrival);
  }

  Random random;
  double last = 0.0;
};

struct Quality {
  double bias_us = 0.0;
  double jitter_us = 0.0;  ///< rms about the bias
  double widest_step = 0.0;
  double narrowest_step = 1e9;
  DeviceClock::Report report;
};

/// Simulates three minutes and measures the last two.
Quality quality(bool batched, bool sync) {
  Device device(3);
  DeviceClock clock;
  std::vector<double> errors_us;
  Quality quality;
  std::vector<std::pair<double, nanoseconds>> batch;
  double batch_arrival = 0.0;
  nanoseconds last_host{0};
  const auto deliver = [&] {
    for (auto& [t, time] : batch) time = clock.observe(time, Device::host(batch_arrival));
    for (const auto& [t, time] : batch) {
      const nanoseconds host = clock.host_time(time);
      EXPECT_GT(host, last_host);
      if (last_host.count() > 0) {
        const auto step = static_cast<double>((host - last_host).count()) * 1e-6;
        quality.widest_step = std::max(quality.widest_step, step);
        quality.narrowest_step = std::min(quality.narrowest_step, step);
      }
      last_host = host;
      if (t > 60.0) {
        errors_us.push_back(static_cast<double>((host - Device::host(t)).count()) * 1e-3);
      }
    }
    batch.clear();
  };
  for (int k = 0; k < 180'000; ++k) {
    const double t = k * 0.001;
    const double arrival = device.arrival(t, batched);
    if (arrival != batch_arrival) deliver();
    batch_arrival = arrival;
    batch.emplace_back(t, Device::clock(t));
    if (sync && k % 1000 < 24 && k % 3 == 0) {
      deliver();
      const double up = t + 0.00015 + device.exponential(0.00015);
      double down = up + 0.0002 + device.exponential(0.0003);
      down = batched ? std::ceil(down / 0.016) * 0.016 : std::ceil(down / 0.001) * 0.001;
      clock.observe({.sent = Device::host(t),
                     .received = Device::host(down),
                     .device_received = Device::clock(up),
                     .device_sent = Device::clock(up)});
    }
  }
  for (const double error : errors_us)
    quality.bias_us += error / static_cast<double>(errors_us.size());
  double squares = 0.0;
  for (const double error : errors_us)
    squares += (error - quality.bias_us) * (error - quality.bias_us);
  quality.jitter_us = std::sqrt(squares / static_cast<double>(errors_us.size()));
  quality.report = clock.report();
  return quality;
}

TEST(DeviceClock, JitterOfUsbFramesAndStallsIsFilteredOut) {
  const Quality reached = quality(false, false);
  EXPECT_LT(reached.jitter_us, 10.0);
  EXPECT_LT(reached.bias_us, 1100.0);  // the latency of the fastest frame
  EXPECT_NEAR(reached.report.drift_ppm, 50.0, 10.0);
  EXPECT_LT(reached.report.jitter_us, 10.0);
  EXPECT_FALSE(reached.report.uncertainty_us);
}

TEST(DeviceClock, BatchesOf16MsAreFilteredOut) {
  const Quality reached = quality(true, false);
  EXPECT_LT(reached.jitter_us, 10.0);
  EXPECT_LT(reached.bias_us, 1200.0);
  EXPECT_NEAR(reached.report.latency_us, 8000.0, 1000.0);
}

TEST(DeviceClock, SyncTakesTheBiasAway) {
  for (const bool batched : {false, true}) {
    const Quality reached = quality(batched, true);
    EXPECT_LT(reached.jitter_us, 10.0) << batched;
    EXPECT_LT(std::fabs(reached.bias_us), batched ? 657.0 : 218.0) << batched;
    ASSERT_TRUE(reached.report.uncertainty_us);
    EXPECT_LT(std::fabs(reached.bias_us), *reached.report.uncertainty_us) << batched;
  }
}

TEST(DeviceClock, MappedTimesKeepTheDevicesPace) {
  const Quality reached = quality(true, false);
  EXPECT_GE(reached.narrowest_step, 0.89);
  EXPECT_LE(reached.widest_step, 1.11);
}

TEST(DeviceClock, AMovedEstimateIsApproachedAtATenthOfThePace) {
  DeviceClock clock;
  nanoseconds last_host{0};
  double narrowest_ms = 1e9;
  double widest_ms = 0.0;
  nanoseconds error{0};
  const auto ask = [&](double t, double there_s, double back_s) {
    const nanoseconds device = seconds{7} + nanoseconds{std::llround((t + there_s) * 1e9)};
    clock.observe({.sent = Device::host(t),
                   .received = Device::host(t + there_s + back_s),
                   .device_received = device,
                   .device_sent = device});
  };
  const auto run = [&](int from, int to) {
    narrowest_ms = 1e9;
    widest_ms = 0.0;
    for (int k = from; k < to; ++k) {
      const nanoseconds device =
          clock.observe(seconds{7} + milliseconds{k}, Device::host(k * 0.001 + 0.0005));
      const nanoseconds host = clock.host_time(device);
      const double step_ms = static_cast<double>((host - last_host).count()) * 1e-6;
      if (k > 0) {
        narrowest_ms = std::min(narrowest_ms, step_ms);
        widest_ms = std::max(widest_ms, step_ms);
      }
      last_host = host;
      error = host - Device::host(k * 0.001);
    }
  };
  run(0, 3000);
  EXPECT_NEAR(narrowest_ms, 1.0, 1e-5);
  EXPECT_NEAR(widest_ms, 1.0, 1e-5);
  ask(3.0, 0.0, 0.040);  // half of this trip is 20 ms too late
  run(3000, 3150);
  EXPECT_NEAR(widest_ms, 1.1, 1e-5);
  EXPECT_LT(error, milliseconds{16});
  run(3150, 4000);
  EXPECT_NEAR(static_cast<double>(error.count()) * 1e-6, 20.0, 0.01);
  ask(4.0, 0.0001, 0.0001);
  run(4000, 5000);
  EXPECT_NEAR(narrowest_ms, 0.9, 1e-5);
  EXPECT_LT(std::fabs(static_cast<double>(error.count())), 10'000.0);
}

TEST(DeviceClock, HalfOfASlowTripIsNoWrongAnswer) {
  const auto error_ms = [](nanoseconds wrong_by) {
    DeviceClock clock;
    // The first frame is held up by 80 ms.
    const nanoseconds device = clock.observe(seconds{7}, Device::host(0.080));
    clock.observe({.sent = Device::host(0.100),
                   .received = Device::host(0.160),
                   .device_received = seconds{7} + milliseconds{158} + wrong_by,
                   .device_sent = seconds{7} + milliseconds{158} + wrong_by});
    return static_cast<double>((clock.host_time(device) - Device::host(0.0)).count()) * 1e-6;
  };
  EXPECT_NEAR(error_ms(nanoseconds{0}), -28.0, 1e-6);
  EXPECT_NEAR(error_ms(milliseconds{40}), 80.0, 1e-6);  // 62 ms beyond half of the trip
  EXPECT_NEAR(error_ms(milliseconds{-300}), 80.0, 1e-6);
}

TEST(DeviceClock, FramesHeldUpForSecondsMoveNothing) {
  Random random(7);
  DeviceClock clock;
  double worst_us = 0.0;
  for (int k = 0; k < 120'000; ++k) {
    const double t = k * 0.001;
    const double fast = t * (1.0 + 80e-6);
    const bool held = (t > 20.0 && t < 22.0) || (t > 60.0 && t < 65.0);
    const double sent = held ? (t < 30.0 ? 22.0 : 65.0) : t;
    const double arrival = sent + 0.0001 + 0.0005 * random.uniform();
    const nanoseconds device =
        clock.observe(nanoseconds{static_cast<std::int64_t>(fast * 1e9)}, Device::host(arrival));
    const nanoseconds host = clock.host_time(device);
    if (t < 10.0) continue;
    const nanoseconds error = host - Device::host(t + 0.0001);
    worst_us = std::max(worst_us, std::fabs(static_cast<double>(error.count()) * 1e-3));
  }
  EXPECT_LT(worst_us, 30.0);
  EXPECT_NEAR(clock.report().drift_ppm, 80.0, 1.0);
  EXPECT_EQ(clock.report().restarts, 0U);
}

TEST(DeviceClock, OneSlowQuestionDoesNotMakeTheFirstSecondsLate) {
  DeviceClock clock;
  const auto ask = [&](double t, double there_s, double back_s) {
    const nanoseconds device = seconds{7} + nanoseconds{std::llround((t + there_s) * 1e9)};
    clock.observe({.sent = Device::host(t),
                   .received = Device::host(t + there_s + back_s),
                   .device_received = device,
                   .device_sent = device});
  };
  for (int k = 0; k < 8; ++k) ask(0.003 * k, 0.0002, 0.0002);
  ask(0.030, 0.0400, 0.0002);  // the device was busy: half of this trip is 20 ms
  for (int k = 100; k < 6000; ++k) {
    const double t = k * 0.001;
    if (k == 4500) ask(t, 0.0400, 0.0002);
    const nanoseconds device =
        clock.observe(seconds{7} + nanoseconds{std::llround(t * 1e9)}, Device::host(t + 0.0005));
    const nanoseconds error = clock.host_time(device) - Device::host(t);
    EXPECT_LT(std::fabs(static_cast<double>(error.count())), 2000.0) << t;
  }
}

TEST(DeviceClock, TheWrapOfACounterChangesNothing) {
  const nanoseconds wrap = microseconds{std::int64_t{1} << 32U};
  DeviceClock clock(wrap);
  const nanoseconds before = wrap - seconds{5};
  for (int k = 0; k < 10'000; ++k) {
    const nanoseconds device =
        clock.observe((before + milliseconds{k}) % wrap, seconds{50} + milliseconds{k});
    EXPECT_EQ(clock.host_time(device), seconds{50} + milliseconds{k});
  }
  EXPECT_EQ(clock.report().restarts, 0U);
  // Two wraps without a frame, because the port was closed.
  const nanoseconds later = 2 * wrap + seconds{1};
  const nanoseconds device =
      clock.observe((before + seconds{10} + later) % wrap, seconds{60} + later);
  EXPECT_EQ(clock.host_time(device), seconds{60} + later);
  EXPECT_EQ(clock.report().restarts, 0U);
}

TEST(DeviceClock, ALostHourDoesNotStopHostTime) {
  DeviceClock clock;
  EXPECT_EQ(clock.host_time(clock.observe(seconds{1}, seconds{10})), seconds{10});
  EXPECT_EQ(clock.host_time(clock.observe(seconds{3601}, seconds{3610})), seconds{3610});
  clock.restart();
  EXPECT_EQ(clock.host_time(clock.observe(seconds{0}, seconds{3611})), seconds{3611});
}

TEST(DeviceClock, AnHourOfOneKilohertzDoesNotDrift) {
  Device device(5);
  DeviceClock clock(microseconds{std::int64_t{1} << 32U});
  double worst_us = 0.0;
  double least_us = 1e9;
  for (int k = 0; k < 3'600'000; ++k) {
    const double t = k * 0.001;
    const double arrival = device.arrival(t, false);
    if (device.random.uniform() < 0.001) continue;  // lost
    const nanoseconds host =
        clock.host_time(clock.observe(Device::clock(t), Device::host(arrival)));
    if (t < 60.0) continue;
    const double error_us = static_cast<double>((host - Device::host(t)).count()) * 1e-3;
    worst_us = std::max(worst_us, error_us);
    least_us = std::min(least_us, error_us);
  }
  EXPECT_LT(worst_us - least_us, 200.0);
  EXPECT_EQ(clock.report().restarts, 0U);
}

}  // namespace
}  // namespace merkel
