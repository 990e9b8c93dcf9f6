// No device clock can silence touch: the samples of a device reach the loop whatever times it
// reports.
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/units.hpp"
#include "drivers/probes/reading_times.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/input/probe_queue.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

/// The time on a device's clock at host time `t_s`; `k` counts its samples.
using FaultyClock = std::function<double(double t_s, int k)>;

struct Outcome {
  std::uint64_t released = 0;       ///< ticks of 1 ms without touch
  std::uint64_t held = 0;           ///< ticks without a newer sample
  std::uint64_t released_late = 0;  ///< of these, after the first 2 s
  double farthest_ms = 0.0;  ///< largest distance of a sample's time from its arrival, after 2 s
  DeviceCounts counts;
  std::vector<std::string> notices;
};

constexpr double kLength_s = 10.0;

/// Ten seconds of a continuous press, read with a delay of 2.5 sample periods.
Outcome touch(double rate_Hz, const FaultyClock& clock,
              ReadingTimes::Rule rule = ReadingTimes::Rule::kMapped) {
  Random random(5);
  ReadingTimes times(rule);
  times.set_wrap(microseconds{std::int64_t{1} << 32U});
  ProbeQueue channel(100'000);
  ProbeInput input(channel, {.stale_after = std::max<nanoseconds>(
                                 milliseconds{50}, units::nanoseconds_from_s(3.0 / rate_Hz))});
  const nanoseconds delay = units::nanoseconds_from_s(2.5 / rate_Hz);
  const nanoseconds start = seconds{1000};
  Outcome outcome;
  nanoseconds last{0};
  nanoseconds tick = start;
  for (int k = 0; k < static_cast<int>(kLength_s * rate_Hz); ++k) {
    const double t_s = k / rate_Hz;
    const nanoseconds arrival =
        start + units::nanoseconds_from_s(t_s + 0.0002 + 0.0003 * random.uniform());
    // Ticks before this sample arrives.
    for (; tick + delay < arrival; tick += milliseconds{1}) {
      const bool silent = input.at(tick).state == ProbeInput::State::kReleased;
      if (tick < start + milliseconds{5} || !silent) continue;
      ++outcome.released;
      if (tick > start + seconds{2}) ++outcome.released_late;
    }
    DeviceReading reading;
    reading.arrival = arrival;
    const double wire_us = std::fmod(1e6 * clock(t_s, k), 4294967296.0);
    reading.device_time =
        microseconds{static_cast<std::int64_t>(wire_us < 0.0 ? wire_us + 4294967296.0 : wire_us)};
    const nanoseconds time = std::max(times.of({&reading, 1}).front(), last + nanoseconds{1});
    last = time;
    if (t_s > 2.0) {
      outcome.farthest_ms =
          std::max(outcome.farthest_ms, std::fabs(units::ms_from(arrival - time)));
    }
    EXPECT_TRUE(channel.try_push(
        {.time = time, .arrival = arrival, .depth_mm = 1.0, .channels = ProbeSample::kDepth}));
    for (std::string& sentence : times.take_notices()) outcome.notices.push_back(sentence);
  }
  times.describe(outcome.counts);
  return outcome;
}

TEST(ClockFaults, OneBadTimeOfAnySizeCostsNoTouch) {
  for (const double rate_Hz : {1000.0, 100.0}) {
    for (double size_s = 1e-3; size_s < 4000.0; size_s *= 3.7) {
      for (const double sign : {1.0, -1.0}) {
        for (const double when_s : {0.0, 0.02, 0.4, 3.0}) {
          const int bad = static_cast<int>(when_s * rate_Hz);
          const Outcome outcome = touch(rate_Hz, [&](double t_s, int k) {
            return 500.0 + t_s + (k == bad ? sign * size_s : 0.0);
          });
          EXPECT_LE(outcome.released, 100U)
              << sign * size_s << " s at " << when_s << " s, " << rate_Hz << " Hz";
          EXPECT_EQ(outcome.released_late, 0U) << sign * size_s << " s at " << when_s << " s";
          EXPECT_TRUE(outcome.counts.device_clock);
          EXPECT_LT(outcome.farthest_ms, 26.0) << sign * size_s << " s at " << when_s << " s";
        }
      }
    }
  }
}

TEST(ClockFaults, AClockThatJumpsIsReanchoredWithin100Ms) {
  for (const double rate_Hz : {1000.0, 100.0}) {
    for (double size_s = 0.05; size_s < 3000.0; size_s *= 3.7) {
      for (const double sign : {1.0, -1.0}) {
        const Outcome outcome = touch(rate_Hz, [&](double t_s, int) {
          return 3100.0 + t_s + (t_s >= 3.0 ? sign * size_s : 0.0);
        });
        EXPECT_LE(outcome.released, 100U) << sign * size_s << " s, " << rate_Hz << " Hz";
        EXPECT_EQ(outcome.counts.clock_anchors, 1U) << sign * size_s << " s, " << rate_Hz << " Hz";
        EXPECT_TRUE(outcome.notices.empty());
      }
    }
  }
}

TEST(ClockFaults, AWrongRateOfAnyFactorCostsAtMostASecondAndIsReported) {
  for (const double rate_Hz : {1000.0, 100.0}) {
    for (const double factor : {-1e6, -372.0, -1.0, -0.5, 0.0,  1e-6, 1e-3, 0.1,  0.5, 0.8,
                                0.85, 0.9,    0.95, 1.06, 1.15, 1.5,  2.0,  10.0, 1e3, 1e6}) {
      const Outcome outcome = touch(rate_Hz, [&](double t_s, int) { return 500.0 + t_s * factor; });
      EXPECT_LE(outcome.released, 1000U) << factor << ", " << rate_Hz << " Hz";
      EXPECT_EQ(outcome.released_late, 0U) << factor << ", " << rate_Hz << " Hz";
      EXPECT_FALSE(outcome.counts.device_clock) << factor;
      EXPECT_EQ(outcome.notices.size(), 1U) << factor;
      EXPECT_LT(outcome.farthest_ms, 60.0) << factor << ", " << rate_Hz << " Hz";
    }
  }
}

TEST(ClockFaults, ACorrectedRateIsTrustedAgain) {
  const Outcome outcome =
      touch(1000.0, [](double t_s, int) { return 500.0 + std::min(t_s, 1.0) * 3.0 + t_s; });
  EXPECT_EQ(outcome.notices.size(), 2U);
  EXPECT_TRUE(outcome.counts.device_clock);
  EXPECT_EQ(outcome.released_late, 0U);
}

/// Ten seconds of a press whose reader is held up for 0 to 200 ms now and then, with a buffer that
/// allows for it: whatever is missing then is the mapping's fault.
Outcome touch_under_load(double share_of_stalls, double rate_Hz, const FaultyClock& clock,
                         std::uint64_t seed) {
  Random random(seed);
  ReadingTimes times(ReadingTimes::Rule::kMapped);
  times.set_wrap(microseconds{std::int64_t{1} << 32U});
  ProbeQueue channel(100'000);
  ProbeInput input(channel, {.stale_after = milliseconds{100}});
  const nanoseconds delay = milliseconds{260};
  const nanoseconds start = seconds{1000};
  Outcome outcome;
  nanoseconds last{0};
  nanoseconds tick = start;
  nanoseconds reader = start;
  std::vector<DeviceReading> batch;
  for (int k = 0; k < static_cast<int>(kLength_s * rate_Hz);) {
    // The reader wakes up and takes what has arrived since.
    const bool stalls = random.uniform() < share_of_stalls;
    reader += stalls ? units::nanoseconds_from_s(0.2 * random.uniform()) : milliseconds{1};
    batch.clear();
    for (; start + units::nanoseconds_from_s(k / rate_Hz + 0.0002) <= reader; ++k) {
      DeviceReading reading;
      reading.arrival = reader;
      const double wire_us = std::fmod(1e6 * clock(k / rate_Hz, k), 4294967296.0);
      reading.device_time =
          microseconds{static_cast<std::int64_t>(wire_us < 0.0 ? wire_us + 4294967296.0 : wire_us)};
      batch.push_back(reading);
    }
    for (; tick + delay < reader; tick += milliseconds{1}) {
      const auto state = input.at(tick).state;
      if (tick < start + milliseconds{5}) continue;
      if (state == ProbeInput::State::kReleased) ++outcome.released;
      if (state == ProbeInput::State::kHeld) ++outcome.held;
    }
    for (nanoseconds time : times.of(batch)) {
      time = std::max(time, last + nanoseconds{1});
      last = time;
      EXPECT_TRUE(channel.try_push(
          {.time = time, .arrival = reader, .depth_mm = 1.0, .channels = ProbeSample::kDepth}));
    }
    for (std::string& sentence : times.take_notices()) outcome.notices.push_back(sentence);
  }
  times.describe(outcome.counts);
  return outcome;
}

TEST(ClockFaults, OneWrongTimeUnderLoadCostsNoTouch) {
  for (const double share : {0.0, 0.005, 0.02, 0.1, 0.5, 1.0}) {
    for (const double size_s : {0.0, 0.02, -0.02, 0.15, -0.15, 0.5, -0.5, 40.0, -40.0}) {
      for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        const int bad = static_cast<int>(400 * seed);
        const Outcome outcome = touch_under_load(
            share, 1000.0,
            [&](double t_s, int k) { return 500.0 + t_s + (k == bad ? size_s : 0.0); }, seed);
        EXPECT_EQ(outcome.released, 0U) << size_s << " s, stalls " << share << ", seed " << seed;
        EXPECT_LE(outcome.held, 20U) << size_s << " s, stalls " << share << ", seed " << seed;
        EXPECT_TRUE(outcome.counts.device_clock) << size_s << " s, stalls " << share;
        EXPECT_NEAR(outcome.counts.clock_rate, 1.0, 0.1) << size_s << " s, stalls " << share;
      }
    }
  }
}

TEST(ClockFaults, AWrongOscillatorUnderLoadCostsNoTouch) {
  for (const double share : {0.0, 0.02, 0.5}) {
    for (const double factor : {0.85, 0.95, 0.99, 1.01, 1.05, 1.15}) {
      for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const Outcome outcome = touch_under_load(
            share, 1000.0, [&](double t_s, int) { return 500.0 + t_s * factor; }, seed);
        EXPECT_EQ(outcome.released, 0U) << factor << ", stalls " << share << ", seed " << seed;
        EXPECT_LE(outcome.held, 20U) << factor << ", stalls " << share << ", seed " << seed;
      }
    }
  }
}

TEST(ClockFaults, ManyWrongTimesCostNoTouch) {
  for (const double share : {0.01, 0.2, 0.6, 1.0}) {
    Random random(9);
    const Outcome outcome = touch(1000.0, [&](double t_s, int) {
      const double wrong = random.uniform() < share ? 1000.0 * (random.uniform() - 0.5) : 0.0;
      return 1500.0 + t_s + wrong;
    });
    EXPECT_EQ(outcome.released, 0U) << share;
    if (share > 0.3) continue;
    EXPECT_NEAR(static_cast<double>(outcome.counts.clock_outliers), share * kLength_s * 1000.0,
                share * 2000.0);
  }
}

TEST(ClockFaults, AnOscillatorErrorOfOnePercentIsNotAFault) {
  for (const double factor : {0.99, 0.999, 1.001, 1.01}) {
    const Outcome outcome = touch(1000.0, [&](double t_s, int) { return 500.0 + t_s * factor; });
    EXPECT_TRUE(outcome.counts.device_clock) << factor;
    EXPECT_EQ(outcome.counts.clock_outliers, 0U) << factor;
    EXPECT_EQ(outcome.counts.clock_anchors, 0U) << factor;
    EXPECT_NEAR(outcome.counts.drift_ppm, (factor - 1.0) * 1e6, 300.0);
    EXPECT_EQ(outcome.released, 0U);
  }
}

TEST(ClockFaults, ATrustedClockCannotSilenceTouchEither) {
  for (const double factor : {0.0, 0.5, 0.99, 1.01, 2.0}) {
    const Outcome outcome = touch(
        1000.0, [&](double t_s, int) { return 500.0 + t_s * factor; }, ReadingTimes::Rule::kDevice);
    EXPECT_LE(outcome.released, 1000U) << factor;
    EXPECT_EQ(outcome.released_late, 0U) << factor;
  }
}

}  // namespace
}  // namespace merkel
