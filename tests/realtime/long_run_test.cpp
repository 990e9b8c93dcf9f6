// A day of virtual time with a device whose clock drifts and whose samples fail in every way. The
// counts must add up, memory must stay flat, and probe time and simulation time must not drift
// apart.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "core/math/random.hpp"
#include "core/units.hpp"
#include "realtime/input/probe_queue.hpp"
#include "realtime/loop/fixed_step_loop.hpp"
#include "tests/realtime/clocks/scripted_clock.hpp"

namespace merkel {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

#ifdef MERKEL_SANITIZED  // takes twenty times as long
constexpr std::uint64_t kHours = 2;
#else
constexpr std::uint64_t kHours = 24;
#endif
constexpr hours kLength{kHours};

/// A device of nominally 50 Hz that runs up to 1 % fast or slow, turning every hour. Its samples
/// are mapped to the host's time, arrive with jitter, and are lost singly or for a second.
class DriftingDevice {
 public:
  /// Delivers the samples that have arrived by now.
  void deliver(nanoseconds now, ProbeQueue& channel) {
    while (next_.arrival <= now && next_.time < kLength) {
      if (!lost_) {
        (channel.try_push(next_) ? channel.delivered : channel.dropped).add();
        last_ = next_.time;
      }
      make_next();
    }
    if (next_.time >= kLength) channel.ended.store(true, std::memory_order_release);
  }
  [[nodiscard]] nanoseconds last() const { return last_; }

 private:
  void make_next() {
    const auto hour = next_.time / hours{1};
    const double rate = hour % 2 == 0 ? 1.01 : 0.99;
    next_.time += units::nanoseconds_from_ms(20.0 / rate);
    const double lateness_ms =
        random_.uniform() < 0.001 ? 100.0 * random_.uniform() : 5.0 * random_.uniform();
    // No sample overtakes another on a serial line.
    next_.arrival = std::max(next_.arrival, next_.time + units::nanoseconds_from_ms(lateness_ms));
    const auto second = next_.time / std::chrono::seconds{1};
    next_.depth_mm = second % 600 < 2 ? 1.5 : 0.0;  // a press of 2 s every ten minutes
    lost_ = random_.uniform() < 0.01 || second % 1000 == 999;
  }

  Random random_{24};
  ProbeSample next_{.channels = ProbeSample::kDepth};
  nanoseconds last_{0};
  bool lost_ = false;
};

double peak_memory_MiB() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

TEST(LongRun, ADayOfVirtualTimeAddsUp) {
  constexpr milliseconds kTick{20};
  constexpr milliseconds kDelay{40};
  TactileModel::Parameters scene;
  scene.tick = kTick;
  auto model = TactileModel::create(scene);
  ASSERT_TRUE(model);
  ProbeQueue channel(4096);
  DriftingDevice device;
  Random random(7);
  Fanout fanout;
  ConsumerChannel& quick = fanout.add_consumer(4096);
  ConsumerChannel& slow = fanout.add_consumer(64);
  LoopStatistics statistics;
  BoundedQueue<LoopEvent> events(4096);
  std::uint64_t taken_by_quick = 0;
  std::uint64_t taken_by_slow = 0;
  std::uint64_t releases = 0;
  std::uint64_t resumes = 0;
  std::uint64_t gaps = 0;
  nanoseconds gap_time{0};
  const auto drain = [&](nanoseconds now, bool all) {
    SpikeEvent spike;
    while (quick.feed<SpikeEvent>().try_pop(spike)) ++taken_by_quick;
    if (all || now / hours{1} % 2 == 1) {
      while (slow.feed<SpikeEvent>().try_pop(spike)) ++taken_by_slow;
    }
    LoopEvent event;
    while (events.try_pop(event)) {
      releases += event.kind == LoopEvent::Kind::kRelease ? 1U : 0U;
      resumes += event.kind == LoopEvent::Kind::kResume ? 1U : 0U;
      gaps += event.kind == LoopEvent::Kind::kGap ? 1U : 0U;
      if (event.kind == LoopEvent::Kind::kGap) gap_time += event.length;
    }
  };
  double memory_MiB = 0.0;
  ScriptedClock clock([&](nanoseconds until) {
    // Occasionally the host takes the core away: for some ticks, or for so many that they are
    // skipped.
    const double luck = random.uniform();
    const double late_ms = luck < 1e-5 ? 800.0 : luck < 1e-4 ? 100.0 : 0.05 * random.uniform();
    const nanoseconds woken = until + units::nanoseconds_from_ms(late_ms);
    device.deliver(woken, channel);
    drain(woken, false);
    if (memory_MiB == 0.0 && woken > hours{1}) memory_MiB = peak_memory_MiB();
    return woken;
  });
  device.deliver(nanoseconds{0}, channel);
  std::vector<ProbeInput> inputs{ProbeInput(channel, {.stale_after = milliseconds{50}})};
  FixedStepLoop<ScriptedClock> loop({.delay = kDelay}, clock, *model, inputs, fanout, statistics,
                                    events);
  const std::atomic<bool> stop{false};
  loop.run(stop);
  drain(nanoseconds{0}, true);

  const ProbeInput::Counts counts = inputs[0].counts();
  EXPECT_GT(channel.delivered.value(), kHours * 170'000);
  EXPECT_EQ(counts.used + counts.late, channel.delivered.value());
  EXPECT_EQ(channel.dropped.value(), 0U);
  EXPECT_GT(counts.late, kHours * 20);
  EXPECT_GT(counts.held_ticks, kHours * 50);
  EXPECT_GT(counts.released_ticks, kHours * 50);
  EXPECT_GE(releases, kHours * 3);  // one per lost second
  EXPECT_EQ(resumes, releases);

  const std::uint64_t made = statistics.spikes.value();
  EXPECT_GT(made, kHours * 200);
  EXPECT_EQ(taken_by_quick + quick.dropped<SpikeEvent>(), made);
  EXPECT_EQ(quick.dropped<SpikeEvent>(), 0U);
  EXPECT_EQ(taken_by_slow + slow.dropped<SpikeEvent>(), made);
  EXPECT_GT(slow.dropped<SpikeEvent>(), 0U);
  EXPECT_EQ(statistics.events_dropped.value(), 0U);

  EXPECT_GT(gaps, kHours / 2);
  EXPECT_EQ(gaps, statistics.gaps.value());
  EXPECT_EQ(gap_time, static_cast<std::int64_t>(statistics.skipped_ticks.value()) * kTick);
  EXPECT_GT(statistics.catch_up_ticks.value(), kHours * 20);
  EXPECT_EQ(statistics.overruns_by_late_wake_up.value(), statistics.overruns.value());

  // The simulation has reached the end of the probe, to within one tick.
  const auto simulated =
      static_cast<std::int64_t>(statistics.ticks.value() + statistics.skipped_ticks.value()) *
      kTick;
  EXPECT_GE(simulated, device.last());
  EXPECT_LE(simulated, device.last() + milliseconds{1000});
#ifndef MERKEL_SANITIZED
  EXPECT_LT(peak_memory_MiB(), memory_MiB + 1.0);
#endif
}

}  // namespace
}  // namespace merkel
