#include "realtime/loop/fixed_step_loop.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "realtime/input/probe_queue.hpp"
#include "tests/realtime/clocks/scripted_clock.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// A loop over one probe in scripted time: 1 ms ticks, wall time = probe time + delay.
class FixedStepLoopTest : public testing::Test {
 protected:
  /// A sample every millisecond from 0 to `end_ms`, of the given depth, with the given times of
  /// arrival; the stream ends with the last sample.
  template <class Arrival>
  void samples(int end_ms, double depth_mm, Arrival arrival) {
    for (int k = 0; k <= end_ms; ++k) {
      scheduled_.push_back({.time = milliseconds{k},
                            .arrival = arrival(k),
                            .depth_mm = depth_mm,
                            .channels = ProbeSample::kDepth});
    }
  }

  /// Runs until all samples are used.
  /// \param wake  maps a requested time to the wake-up
  /// \param work  computing time of the work that begins at a given time
  template <class Wake>
  void run(Wake wake, nanoseconds delay, std::int64_t max_catch_up = 20,
           ScriptedClock::Work work = {}, bool starts_behind = false) {
    std::size_t next = 0;
    const auto deliver = [&](nanoseconds now) {
      while (next < scheduled_.size() && scheduled_[next].arrival <= now) {
        EXPECT_TRUE(channel_.try_push(scheduled_[next++]));
      }
      channel_.ended = next == scheduled_.size();
    };
    deliver(nanoseconds{0});
    ScriptedClock clock(
        [&](nanoseconds until) {
          const nanoseconds woken = wake(until);
          deliver(woken);
          return woken;
        },
        std::move(work), host_stops_);
    std::vector<ProbeInput> inputs{ProbeInput(channel_, {.stale_after = milliseconds{50}})};
    FixedStepLoop<ScriptedClock> loop({.start = nanoseconds{0},
                                       .wall_offset = nanoseconds{0},
                                       .delay = delay,
                                       .starts_behind = starts_behind,
                                       .duration = {},
                                       .max_catch_up_ticks = max_catch_up,
                                       .timings = timings_},
                                      clock, model_, inputs, fanout_, statistics_, events_);
    loop.run(stop_);
    counts_ = inputs[0].counts();
    LoopEvent event;
    while (events_.try_pop(event)) raised_.push_back(event);
  }
  static nanoseconds on_time(nanoseconds until) { return until; }

  TactileModel model_ = *TactileModel::create({});
  ProbeQueue channel_{100'000};
  std::vector<ProbeSample> scheduled_;
  Fanout fanout_;
  LoopStatistics statistics_;
  BoundedQueue<LoopEvent> events_{1000};
  std::atomic<bool> stop_{false};
  ProbeInput::Counts counts_;
  std::vector<LoopEvent> raised_;
  BoundedQueue<TickTiming>* timings_ = nullptr;
  ScriptedClock::Work host_stops_;  ///< for how long, during the work of a tick
};

TEST_F(FixedStepLoopTest, PunctualSamplesAreAllUsedOnce) {
  samples(100, 1.5, [](int k) { return milliseconds{k}; });
  run(on_time, milliseconds{2});
  EXPECT_EQ(statistics_.ticks.value(), 100U);
  EXPECT_EQ(counts_.used, 101U);
  EXPECT_EQ(counts_.late, 0U);
  EXPECT_EQ(counts_.held_ticks, 0U);
  EXPECT_EQ(statistics_.overruns.value(), 0U);
  EXPECT_TRUE(raised_.empty());
}

TEST_F(FixedStepLoopTest, TheDelayAbsorbsJitterBelowIt) {
  samples(100, 1.5, [](int k) { return milliseconds{k + (k % 3)}; });
  run(on_time, milliseconds{3});
  EXPECT_EQ(counts_.late, 0U);
  EXPECT_EQ(counts_.held_ticks, 0U);
}

TEST_F(FixedStepLoopTest, SamplesLaterThanTheDelayAreHeldOverAndCounted) {
  // Samples 40…44 arrive together with 45. With a delay of 2 ms, the ticks due at 41…45 (probe
  // time 39…43) find no sample beyond their time, except at 39; samples 40, 41 and 42 arrive late.
  samples(100, 1.5, [](int k) { return milliseconds{k >= 40 && k < 45 ? 45 : k}; });
  run(on_time, milliseconds{2});
  EXPECT_EQ(counts_.held_ticks, 3U);
  EXPECT_EQ(counts_.late, 3U);
  EXPECT_EQ(counts_.used + counts_.late, 101U);
  EXPECT_TRUE(raised_.empty());
}

TEST_F(FixedStepLoopTest, ASilentProbeIsReleasedAndResumed) {
  for (int k = 0; k <= 300; ++k) {
    if (k > 100 && k < 200) continue;
    scheduled_.push_back({.time = milliseconds{k},
                          .arrival = milliseconds{k},
                          .depth_mm = 1.5,
                          .channels = ProbeSample::kDepth});
  }
  run(on_time, milliseconds{2});
  EXPECT_EQ(statistics_.ticks.value(), 300U);
  EXPECT_EQ(counts_.held_ticks, 50U);      // 101…150
  EXPECT_EQ(counts_.released_ticks, 49U);  // 151…199
  ASSERT_EQ(raised_.size(), 2U);
  EXPECT_EQ(raised_[0].kind, LoopEvent::Kind::kRelease);
  EXPECT_EQ(raised_[0].time, milliseconds{151});
  EXPECT_EQ(raised_[1].kind, LoopEvent::Kind::kResume);
  EXPECT_EQ(raised_[1].time, milliseconds{200});
  EXPECT_EQ(raised_[1].length, milliseconds{100});
}

TEST_F(FixedStepLoopTest, AShortStallIsCaughtUp) {
  samples(200, 1.5, [](int k) { return milliseconds{k}; });
  run([](nanoseconds until) { return until == milliseconds{52} ? until + milliseconds{7} : until; },
      milliseconds{2});
  EXPECT_EQ(statistics_.ticks.value(), 200U);
  EXPECT_EQ(statistics_.catch_up_ticks.value(), 7U);
  EXPECT_EQ(statistics_.overruns.value(), 6U);  // the seventh ends exactly at its deadline
  EXPECT_EQ(statistics_.longest_overrun_ns.value(), 6'000'000U);
  EXPECT_EQ(statistics_.overruns_by_late_wake_up.value(), 6U);
  EXPECT_EQ(statistics_.gaps.value(), 0U);
  EXPECT_EQ(counts_.late, 0U);
  const auto wake_ups = statistics_.wake_up.snapshot();
  EXPECT_EQ(wake_ups.count(), 200U - 7U);  // ticks that were caught up did not wait
  EXPECT_EQ(wake_ups.longest(), milliseconds{7});
  EXPECT_EQ(wake_ups.quantile(0.99), nanoseconds{0});
}

TEST_F(FixedStepLoopTest, ALongComputationIsDistinguishedFromALateWakeUp) {
  samples(200, 1.5, [](int k) { return milliseconds{k}; });
  // The tick due at 52 computes for 3.5 ms, so it and the next two overrun. All other ticks
  // compute for 0.1 ms, so the third one after it is on time again. The tick due at 102 wakes 1.5
  // ms late, and only this tick overruns.
  run(
      [](nanoseconds until) {
        return until == milliseconds{102} ? until + units::nanoseconds_from_ms(1.5) : until;
      },
      milliseconds{2}, 20,
      [](nanoseconds started) {
        return units::nanoseconds_from_ms(started == milliseconds{52} ? 3.5 : 0.1);
      });
  EXPECT_EQ(statistics_.ticks.value(), 200U);
  EXPECT_EQ(statistics_.overruns.value(), 4U);
  EXPECT_EQ(statistics_.overruns_by_long_compute.value(), 3U);  // over by 2.5, 1.6 and 0.7 ms
  EXPECT_EQ(statistics_.overruns_by_late_wake_up.value(), 1U);  // by 0.6 ms
  EXPECT_EQ(statistics_.longest_overrun_ns.value(), 2'500'000U);
  EXPECT_EQ(statistics_.tick.snapshot().longest(), units::nanoseconds_from_ms(3.5));
  EXPECT_EQ(statistics_.tick.snapshot().count(), 200U);
}

TEST_F(FixedStepLoopTest, ATickThatTheHostStopsIsNotALongComputation) {
  samples(200, 1.5, [](int k) { return milliseconds{k}; });
  // Of two ticks of 3.5 ms, the host stops one for 3.4 ms; the other computes all the time.
  host_stops_ = [](nanoseconds started) {
    return units::nanoseconds_from_ms(started == milliseconds{52} ? 3.4 : 0.0);
  };
  run(on_time, milliseconds{2}, 20, [](nanoseconds started) {
    const bool takes_long = started == milliseconds{52} || started == milliseconds{102};
    return units::nanoseconds_from_ms(takes_long ? 3.5 : 0.1);
  });
  EXPECT_EQ(statistics_.overruns.value(), 6U);
  EXPECT_EQ(statistics_.overruns_by_late_wake_up.value(), 3U);  // the stopped one and two after it
  EXPECT_EQ(statistics_.overruns_by_long_compute.value(), 3U);
  EXPECT_EQ(statistics_.processor.snapshot().longest(), units::nanoseconds_from_ms(3.5));
}

TEST_F(FixedStepLoopTest, AModelThatNeverKeepsUpLeavesGapsAndContinues) {
  // Each 1 ms tick computes for 2 ms, and the loop rests for 2.5 ms after every 20 ms. After 17 or
  // 18 ticks it is 21 ticks behind and skips them.
  samples(1000, 1.5, [](int k) { return milliseconds{k}; });
  run(on_time, milliseconds{2}, 20, [](nanoseconds) { return milliseconds{2}; });
  const std::uint64_t ticks = statistics_.ticks.value();
  EXPECT_EQ(statistics_.gaps.value(), 26U);
  EXPECT_EQ(statistics_.skipped_ticks.value(), 555U);
  EXPECT_EQ(ticks, 446U);  // the last gap extends beyond the last sample
  EXPECT_EQ(statistics_.overruns.value(), ticks);
  EXPECT_EQ(statistics_.overruns_by_long_compute.value(), ticks);
  EXPECT_EQ(raised_.size(), 26U);
}

/// A loop whose devices were measured for a second before its first tick, on machines that need
/// different parts of a tick for it.
class FixedStepLoopBehind : public FixedStepLoopTest, public testing::WithParamInterface<double> {};

TEST_P(FixedStepLoopBehind, CatchesUpInPiecesAndRestsBetweenThem) {
  constexpr milliseconds kEnd{12'000};
  samples(12'000, 1.5, [](int k) { return milliseconds{k}; });
  nanoseconds worked{0};  // until then
  nanoseconds woken{0};
  nanoseconds longest_work{0};
  nanoseconds slept{0};
  run(
      [&](nanoseconds until) {
        if (woken.count() == 0) return woken = milliseconds{1000};
        if (until == worked) return until;  // late: no wait
        longest_work = std::max(longest_work, worked - woken);
        slept += until - worked;
        return woken = until;
      },
      milliseconds{2}, 20,
      [&](nanoseconds started) {
        const nanoseconds work = units::nanoseconds_from_ms(GetParam());
        worked = started + work;
        return work;
      },
      true);
  EXPECT_EQ(statistics_.ticks.value(), 12'000U);
  EXPECT_EQ(statistics_.gaps.value(), 0U);
  EXPECT_EQ(statistics_.overruns.value(), 0U);
  EXPECT_EQ(statistics_.behind_at_start_ns.load(), 0);
  EXPECT_GE(longest_work, milliseconds{20});
  EXPECT_LE(longest_work, milliseconds{21});
  EXPECT_GT(slept, kEnd / 10);
}

INSTANTIATE_TEST_SUITE_P(TickOfMs, FixedStepLoopBehind, testing::Values(0.1, 0.35, 0.7));

TEST_F(FixedStepLoopTest, ALongStallLeavesAGapAndKeepsThePhase) {
  samples(200, 1.5, [](int k) { return milliseconds{k}; });
  run(
      [](nanoseconds until) {
        return until == milliseconds{52} ? until + units::nanoseconds_from_ms(30.4) : until;
      },
      milliseconds{2});
  EXPECT_EQ(statistics_.gaps.value(), 1U);
  EXPECT_EQ(statistics_.skipped_ticks.value(), 30U);
  EXPECT_EQ(statistics_.ticks.value(), 170U);
  ASSERT_EQ(raised_.size(), 1U);
  EXPECT_EQ(raised_[0].kind, LoopEvent::Kind::kGap);
  EXPECT_EQ(raised_[0].time, milliseconds{49});
  EXPECT_EQ(raised_[0].length, milliseconds{30});
}

TEST_F(FixedStepLoopTest, StopsWithinATick) {
  samples(200, 1.5, [](int k) { return milliseconds{k}; });
  run(
      [this](nanoseconds until) {
        if (until == milliseconds{52}) stop_ = true;
        return until;
      },
      milliseconds{2});
  EXPECT_EQ(statistics_.ticks.value(), 50U);
}

TEST_F(FixedStepLoopTest, ADriftingDeviceClockLosesNothing) {
  // The mapped times run 1 % fast against the host for a second. The loop follows them; samples
  // that the jitter buffer cannot absorb are held and late, never lost.
  for (int k = 0; k <= 1000; ++k) {
    scheduled_.push_back({.time = nanoseconds{k * 990'000LL},
                          .arrival = milliseconds{k},
                          .depth_mm = 1.5,
                          .channels = ProbeSample::kDepth});
  }
  run(on_time, milliseconds{2});
  EXPECT_EQ(counts_.used + counts_.late, 1001U);
  EXPECT_GT(counts_.late, 700U);
  EXPECT_EQ(statistics_.gaps.value(), 0U);
}

TEST_F(FixedStepLoopTest, ASlowDeviceClockIsHeldOnlyForTheMissingTime) {
  // The mapped times run 1 % slow against the host: sample k has the time 1.01·k ms and arrives at
  // 1.01·k ms, but the host counts milliseconds. No sample is late, and none is missing for longer
  // than the delay covers.
  for (int k = 0; k <= 1000; ++k) {
    scheduled_.push_back({.time = nanoseconds{k * 1'010'000LL},
                          .arrival = nanoseconds{k * 1'010'000LL},
                          .depth_mm = 1.5,
                          .channels = ProbeSample::kDepth});
  }
  run(on_time, milliseconds{2});
  EXPECT_EQ(statistics_.ticks.value(), 1010U);
  EXPECT_EQ(counts_.used, 1001U);
  EXPECT_EQ(counts_.late, 0U);
  EXPECT_EQ(counts_.held_ticks, 0U);
  EXPECT_EQ(counts_.released_ticks, 0U);
  EXPECT_EQ(statistics_.gaps.value(), 0U);
}

TEST_F(FixedStepLoopTest, AWellMappedFastDeviceLosesNothing) {
  // 1 % more samples than milliseconds, each mapped to the host's time: occasionally two fall into
  // one tick.
  for (int k = 0; k <= 1010; ++k) {
    scheduled_.push_back({.time = nanoseconds{k * 990'000LL},
                          .arrival = nanoseconds{k * 990'000LL},
                          .depth_mm = 1.5,
                          .channels = ProbeSample::kDepth});
  }
  run(on_time, milliseconds{2});
  EXPECT_EQ(statistics_.ticks.value(), 1000U);
  EXPECT_EQ(counts_.used, 1011U);
  EXPECT_EQ(counts_.late, 0U);
  EXPECT_EQ(counts_.held_ticks, 0U);
}

TEST_F(FixedStepLoopTest, AWaitOfSecondsCanBeStopped) {
  samples(200, 1.5, [](int k) { return milliseconds{k}; });
  nanoseconds latest{0};
  run(
      [&](nanoseconds until) {
        latest = until;
        if (until >= milliseconds{20}) stop_ = true;
        return until;
      },
      std::chrono::seconds{10});
  EXPECT_EQ(statistics_.ticks.value(), 0U);
  EXPECT_EQ(latest, milliseconds{20});
}

TEST_F(FixedStepLoopTest, EveryTickWithSpikesIsTimed) {
  BoundedQueue<TickTiming> timings(1000);
  timings_ = &timings;
  samples(200, 1.5, [](int k) { return milliseconds{k}; });
  run([](nanoseconds until) { return until + std::chrono::microseconds{30}; }, milliseconds{2}, 20,
      [](nanoseconds) { return std::chrono::microseconds{50}; });
  TickTiming timing;
  int count = 0;
  for (; timings.try_pop(timing); ++count) {
    EXPECT_EQ(timing.due, timing.end + milliseconds{2});
    EXPECT_EQ(timing.arrival, timing.end);
    EXPECT_EQ(timing.started, timing.due + std::chrono::microseconds{30});
    EXPECT_EQ(timing.computed, timing.started + std::chrono::microseconds{50});
    EXPECT_EQ(timing.published, timing.computed);
  }
  EXPECT_GT(count, 5);
  EXPECT_EQ(statistics_.timings_dropped.value(), 0U);
  EXPECT_EQ(statistics_.queue.snapshot().longest(),
            milliseconds{2} + std::chrono::microseconds{30});
}

TEST_F(FixedStepLoopTest, AFullQueueAffectsOnlyItsOwnConsumer) {
  ConsumerChannel& slow = fanout_.add_consumer(4);
  ConsumerChannel& quick = fanout_.add_consumer(10'000);
  samples(1000, 1.5, [](int k) { return milliseconds{k}; });
  run(on_time, milliseconds{2});
  const auto drain = [](ConsumerChannel& channel) {
    SpikeEvent spike;
    std::uint64_t count = 0;
    while (channel.feed<SpikeEvent>().try_pop(spike)) ++count;
    return count;
  };
  const std::uint64_t made = statistics_.spikes.value();
  EXPECT_GT(made, 100U);
  EXPECT_EQ(drain(quick), made);
  EXPECT_EQ(quick.dropped<SpikeEvent>(), 0U);
  const std::uint64_t taken = drain(slow);
  EXPECT_LT(taken, made);
  EXPECT_EQ(taken + slow.dropped<SpikeEvent>(), made);
}

TEST_F(FixedStepLoopTest, SpikesOfHeldTicksAreFlagged) {
  ConsumerChannel& consumer = fanout_.add_consumer(10'000);
  samples(200, 1.5, [](int k) { return milliseconds{k >= 100 && k < 130 ? 130 : k}; });
  run(on_time, milliseconds{2});
  SpikeEvent spike;
  int held = 0;
  while (consumer.feed<SpikeEvent>().try_pop(spike)) {
    const bool flagged = (spike.flags & SpikeEvent::kInputHeld) != 0;
    held += flagged ? 1 : 0;
    EXPECT_EQ(flagged, spike.time > milliseconds{99} && spike.time <= milliseconds{127});
  }
  EXPECT_GT(held, 0);
}

}  // namespace
}  // namespace merkel
