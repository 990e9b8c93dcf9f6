// The delay of the loop: measured over a sliding window, changed in both directions, and without
// any effect on what is simulated.
#include "realtime/loop/delay_control.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/scene/tactile_model.hpp"
#include "core/units.hpp"
#include "realtime/input/probe_queue.hpp"
#include "realtime/loop/fixed_step_loop.hpp"
#include "tests/realtime/clocks/scripted_clock.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using State = TickRecord::State;

/// Samples of a steady device for an estimate.
class SteadyDevice {
 public:
  explicit SteadyDevice(DelayEstimate& estimate) : estimate_(estimate) {}
  /// \param late  lateness of each arrival
  template <class Late>
  void run(double period_ms, double length_ms, Late late) {
    const nanoseconds period = units::nanoseconds_from_ms(period_ms);
    for (const nanoseconds end = time_ + units::nanoseconds_from_ms(length_ms); time_ < end;) {
      time_ += period;
      arrival_ = std::max(arrival_, time_ + late());
      estimate_.add({.time = time_, .arrival = arrival_});
    }
  }
  [[nodiscard]] nanoseconds now() const { return time_; }

 private:
  DelayEstimate& estimate_;
  nanoseconds time_{0};
  nanoseconds arrival_{0};
};

double needed_ms(const DelayEstimate& estimate) {
  return units::ms_from(estimate.needed().value_or(nanoseconds{0}));
}

constexpr auto kPunctual = [] { return microseconds{100}; };

TEST(DelayEstimate, IsAPeriodAndTheLatenessOfAllButAShareOfTheSamples) {
  DelayEstimate estimate({.held_share = 0.001});
  EXPECT_FALSE(estimate.needed());
  SteadyDevice device(estimate);
  int count = 0;
  // 3 of 4000 samples are 20 ms late, and 100 are 2 ms late.
  device.run(1.0, 4000.0, [&] {
    ++count;
    return count % 1500 == 0 ? milliseconds{20}
           : count % 40 == 0 ? milliseconds{2}
                             : milliseconds{0};
  });
  // A late sample delays those behind it, so the share is a bit larger.
  EXPECT_GT(needed_ms(estimate), 3.0);
  DelayEstimate generous({.held_share = 0.02});
  SteadyDevice same(generous);
  count = 0;
  same.run(1.0, 4000.0, [&] { return ++count % 1500 == 0 ? milliseconds{20} : milliseconds{0}; });
  EXPECT_NEAR(needed_ms(generous), 1.0, 0.06);
}

TEST(DelayEstimate, GrowsWithinASecondAndShrinksAfterTheWindow) {
  DelayEstimate estimate({});
  SteadyDevice device(estimate);
  device.run(1.0, 5000.0, kPunctual);
  EXPECT_NEAR(needed_ms(estimate), 1.1, 0.08);
  device.run(1.0, 500.0, [] { return milliseconds{8}; });
  EXPECT_NEAR(needed_ms(estimate), 9.0, 0.5);
  device.run(1.0, 4600.0, kPunctual);
  EXPECT_NEAR(needed_ms(estimate), 1.1, 0.08);
}

TEST(DelayEstimate, AStallOfTheHostIsNotChargedToTheDevice) {
  for (const bool host : {false, true}) {
    DelayEstimate estimate({});
    SteadyDevice device(estimate);
    device.run(1.0, 3000.0, kPunctual);
    const nanoseconds begin = device.now();
    const nanoseconds end = begin + milliseconds{500};
    if (host) estimate.add_stall(begin, end);
    device.run(1.0, 500.0, [&] { return end - device.now() + microseconds{100}; });
    device.run(1.0, 500.0, kPunctual);
    if (host) {
      EXPECT_LT(needed_ms(estimate), 1.4);
    } else {
      EXPECT_GT(needed_ms(estimate), 400.0);
    }
  }
}

TEST(DelayEstimate, AStallMayBeReportedAfterTheSamplesThatWaitedForIt) {
  DelayEstimate estimate({});
  SteadyDevice device(estimate);
  device.run(1.0, 1000.0, kPunctual);
  const nanoseconds begin = device.now();
  const nanoseconds end = begin + milliseconds{12};
  device.run(1.0, 14.0, [&] { return std::max(end - device.now(), nanoseconds{0}); });
  estimate.add_stall(begin, end);
  device.run(1.0, 500.0, kPunctual);
  EXPECT_LT(needed_ms(estimate), 1.3);
}

TEST(DelayEstimate, AStallThatSeveralCoresReportIsDeductedOnce) {
  DelayEstimate estimate({});
  SteadyDevice device(estimate);
  device.run(1.0, 3000.0, kPunctual);
  const nanoseconds begin = device.now();
  const nanoseconds end = begin + milliseconds{50};
  estimate.add_stall(begin, end);
  estimate.add_stall(begin - microseconds{300}, end + microseconds{200});
  // The device itself is 6 ms late meanwhile.
  device.run(1.0, 50.0, [&] { return end - device.now() + milliseconds{6}; });
  device.run(1.0, 500.0, kPunctual);
  EXPECT_NEAR(needed_ms(estimate), 7.0, 0.4);
}

// A press beyond a limit, whose readings are refused, may follow the opening of the device.
TEST(DelayEstimate, ASilenceAfterTheFirstSamplesIsAnOutage) {
  DelayEstimate estimate({});
  SteadyDevice device(estimate);
  device.run(12.0, 96.0, kPunctual);
  device.run(690.0, 690.0, kPunctual);
  device.run(12.0, 500.0, kPunctual);
  EXPECT_LT(needed_ms(estimate), 14.0);
}

TEST(DelayEstimate, WithoutInterpolationOnlyTheLatenessCounts) {
  DelayEstimate estimate({.interpolate = false});
  SteadyDevice device(estimate);
  device.run(12.0, 4000.0, [] { return microseconds{300}; });
  EXPECT_NEAR(needed_ms(estimate), 0.32, 0.03);
}

/// The need of a device that samples a while after the end of each tick. The ticks take 1 ms.
double needed_at_ms(double place_ms, bool interpolate, double period_ms = 1.0) {
  DelayEstimate estimate({.interpolate = interpolate});
  estimate.set_ticks(-units::nanoseconds_from_ms(place_ms), milliseconds{1});
  SteadyDevice device(estimate);
  device.run(period_ms, 1000.0, kPunctual);
  return needed_ms(estimate);
}

TEST(DelayEstimate, NoTickWaitsLongerThanThePlaceOfTheSamplesRequires) {
  // A sample 0.7 ms after the end of a tick is awaited from there on. Margin and resolution: 0.06.
  EXPECT_NEAR(needed_at_ms(0.7, true), 0.8, 0.06);
  EXPECT_NEAR(needed_at_ms(0.2, true), 0.3, 0.04);
  // Without interpolation, the sample before the end of the tick has arrived 0.6 ms earlier.
  EXPECT_NEAR(needed_at_ms(0.3, false), 0.02, 0.001);
  EXPECT_NEAR(needed_at_ms(0.95, false), 0.07, 0.01);
  // A device at the border of two ticks needs what either may need.
  EXPECT_NEAR(needed_at_ms(0.99, true), 1.1, 0.06);
  EXPECT_NEAR(needed_at_ms(0.02, true), 1.14, 0.06);
  EXPECT_NEAR(needed_at_ms(0.02, false), 0.14, 0.02);
  // Of eight samples a tick, one is awaited.
  EXPECT_NEAR(needed_at_ms(0.0625, true, 0.125), 0.18, 0.02);
  EXPECT_NEAR(needed_at_ms(0.0625, false, 0.125), 0.06, 0.02);
  // One of 10 ms ends its wait in the first tick.
  EXPECT_NEAR(needed_at_ms(0.4, true, 10.0), 9.5, 0.3);
}

TEST(DelayEstimate, ADriftingDeviceIsNeverLate) {
  for (const bool interpolate : {true, false}) {
    for (const double drift_ppm : {-100.0, 100.0}) {
      const double period_ms = 1.0 + 1e-6 * drift_ppm;
      DelayEstimate estimate({.interpolate = interpolate});
      estimate.set_ticks(nanoseconds{0}, milliseconds{1});
      std::vector<ProbeSample> samples;
      nanoseconds delay{2'000'000};
      std::size_t newest = 0;
      int late = 0;
      for (int k = 1; k < 40'000; ++k) {
        const nanoseconds time = units::nanoseconds_from_ms(0.3 + k * period_ms);
        samples.push_back({.time = time, .arrival = time + microseconds{100}});
      }
      for (int tick = 10; tick < 39'000; ++tick) {
        const nanoseconds end = tick * milliseconds{1};
        for (; samples[newest + 1].time <= end; ++newest) estimate.add(samples[newest]);
        const ProbeSample& awaited = samples[newest + (interpolate ? 1 : 0)];
        if (awaited.arrival > end + delay) ++late;
        if (tick % 16 != 0) continue;
        delay = std::clamp(estimate.needed().value_or(delay), delay - microseconds{320},
                           delay + milliseconds{8});
      }
      EXPECT_EQ(late, 0) << interpolate << drift_ppm;
    }
  }
}

TEST(DelayEstimate, AnOutageIsNoLateness) {
  DelayEstimate estimate({});
  SteadyDevice device(estimate);
  device.run(1.0, 1000.0, kPunctual);
  device.run(3000.0, 3000.0, kPunctual);
  device.run(1.0, 1000.0, kPunctual);
  EXPECT_NEAR(needed_ms(estimate), 1.1, 0.08);
}

// As after a clock that was mapped anew: its times must not go back.
TEST(DelayEstimate, SamplesThatWereCloseForAWhileDoNotMakeTheOthersOutages) {
  DelayEstimate estimate({});
  SteadyDevice device(estimate);
  device.run(1.0, 1000.0, kPunctual);
  device.run(0.001, 1.0, [] { return milliseconds{40}; });
  EXPECT_GT(needed_ms(estimate), 30.0);
  device.run(1.0, 6000.0, kPunctual);
  EXPECT_LT(needed_ms(estimate), 2.0);
}

TEST(DelayEstimate, TheCeilingDependsOnTheRate) {
  DelayEstimate fast({});
  SteadyDevice(fast).run(1.0, 1000.0, kPunctual);
  EXPECT_EQ(fast.ceiling(), milliseconds{50});
  DelayEstimate slow({});
  SteadyDevice(slow).run(40.0, 4000.0, kPunctual);
  EXPECT_EQ(slow.ceiling(), milliseconds{120});
  DelayEstimate chosen({.max_delay = milliseconds{7}});
  SteadyDevice(chosen).run(1.0, 1000.0, kPunctual);
  EXPECT_EQ(chosen.ceiling(), milliseconds{7});
}

/// A live run on a scripted clock, and what it recorded.
class LiveRun {
 public:
  explicit LiveRun(TactileModel& model) : model_(model) {
    channel_of_records_ = &fanout_.add_consumer(4'096);
    channel_of_records_->add<TickRecord>(4'096);
  }

  /// \param arrivals  one per sample; a sample each millisecond
  void run(const std::vector<ProbeSample>& samples, const std::vector<nanoseconds>& wake_ups,
           bool measured) {
    std::size_t next = 0;
    const auto deliver = [&](nanoseconds now) {
      while (next < samples.size() && samples[next].arrival <= now) {
        ASSERT_TRUE(channel_.try_push(samples[next++]));
      }
      channel_.ended = next == samples.size();
    };
    deliver(samples.front().arrival);
    std::size_t wait = 0;
    ScriptedClock clock([&](nanoseconds until) {
      const nanoseconds woken =
          until + (wake_ups.empty() ? nanoseconds{0} : wake_ups[wait++ % wake_ups.size()]);
      deliver(woken);
      return woken;
    });
    std::vector<ProbeInput> inputs{ProbeInput(channel_, {.stale_after = milliseconds{400}})};
    if (measured) inputs[0].measure_delay();
    DelayControl control(delay_ns, shortage);
    FixedStepLoop<ScriptedClock> loop(
        {.delay = nanoseconds{delay_ns.load()}, .delay_control = measured ? &control : nullptr},
        clock, model_, inputs, fanout_, statistics, events_);
    model_.reset();
    loop.run(stop_);
    channel_of_records_->feed<TickRecord>().take(records);
    channel_of_records_->feed<SpikeEvent>().take(spikes);
  }

  std::atomic<std::int64_t> delay_ns{2'000'000};
  DelayControl::Shortage shortage;
  LoopStatistics statistics;
  std::vector<TickRecord> records;
  std::vector<SpikeEvent> spikes;

 private:
  TactileModel& model_;
  ProbeQueue channel_{10'000};
  Fanout fanout_;
  ConsumerChannel* channel_of_records_;
  BoundedQueue<LoopEvent> events_{1000};
  std::atomic<bool> stop_{false};
};

/// Two seconds of taps, a sample each millisecond, whose lateness changes at random.
std::vector<ProbeSample> wandering(Random& random, int count) {
  std::vector<ProbeSample> samples;
  nanoseconds arrival{0};
  double depth_mm = 0.0;
  double late_ms = 0.1;
  for (int k = 0; k < count; ++k) {
    if (random.uniform() < 0.02)
      depth_mm = random.uniform() < 0.3 ? -0.1 : random.uniform(0.0, 2.0);
    if (random.uniform() < 0.01) late_ms = random.uniform() < 0.6 ? 0.1 : random.uniform(0.1, 30.0);
    const nanoseconds time = k * milliseconds{1};
    arrival =
        std::max(arrival, time + units::nanoseconds_from_ms(late_ms * random.uniform(0.5, 1.0)));
    samples.push_back({.time = time,
                       .arrival = arrival,
                       .depth_mm = depth_mm,
                       .sequence = static_cast<std::uint32_t>(k),
                       .channels = ProbeSample::kDepth});
  }
  return samples;
}

TEST(DelayControl, NoWalkOfTheDelayChangesAnInputOrASpike) {
  TactileModel model = *TactileModel::create({});
  TactileModel again = *TactileModel::create({});
  std::uint64_t changes = 0;
  std::uint64_t spikes = 0;
  nanoseconds least = nanoseconds::max();
  nanoseconds most{0};
  constexpr int kWalks = 1000;
  for (std::uint64_t seed = 1; seed <= kWalks; ++seed) {
    Random random(seed);
    std::vector<ProbeSample> samples = wandering(random, 250);
    LiveRun live(model);
    std::vector<nanoseconds> wake_ups;
    for (int k = 0; k < 97; ++k) {
      wake_ups.push_back(random.uniform() < 0.03 ? nanoseconds{milliseconds{1 + random.next() % 6}}
                                                 : nanoseconds{0});
    }
    live.run(samples, wake_ups, true);
    // The same samples without any lateness: what a recording of them gives.
    for (ProbeSample& sample : samples) sample.arrival = sample.time;
    LiveRun recording(again);
    recording.run(samples, {}, false);
    ASSERT_EQ(recording.statistics.held_ticks.value(), 0U);
    std::size_t of_recording = 0;
    for (std::size_t k = 0; k < live.records.size(); ++k) {
      const TickRecord& tick = live.records[k];
      if (k > 0 && tick.delay != live.records[k - 1].delay) ++changes;
      least = std::min(least, tick.delay);
      most = std::max(most, tick.delay);
      // Behind the last sample, the live run may have waited for it.
      if (tick.time > recording.records.back().time) break;
      while (recording.records.at(of_recording).time < tick.time) ++of_recording;
      ASSERT_EQ(recording.records[of_recording].time, tick.time) << "the grid moved, seed " << seed;
      if (tick.state != State::kFollowing) continue;
      ASSERT_EQ(recording.records[of_recording].contact.depth_mm, tick.contact.depth_mm)
          << "tick " << tick.number << " of seed " << seed;
    }
    // The recorded inputs give the recorded spikes, bit for bit.
    again.reset();
    std::size_t next = 0;
    for (const TickRecord& tick : live.records) {
      const std::vector<ContactInput> contacts{tick.contact};
      for (const SpikeEvent& spike : again.step(contacts, tick.time - milliseconds{1})) {
        ASSERT_LT(next, live.spikes.size());
        ASSERT_EQ(live.spikes[next].time, spike.time) << "seed " << seed;
        ASSERT_EQ(live.spikes[next].neuron, spike.neuron) << "seed " << seed;
        ++next;
      }
    }
    ASSERT_EQ(next, live.spikes.size());
    spikes += next;
  }
  EXPECT_GT(changes, 20'000U);
  EXPECT_GT(spikes, 1'000U);
  EXPECT_LT(least, microseconds{1700});
  EXPECT_GT(most, milliseconds{20});
}

TEST(DelayControl, IsAtOnceWhatIsNeededWhileTheStartIsCaughtUp) {
  for (const bool catches_up : {false, true}) {
    ProbeQueue channel{16};
    std::vector<ProbeInput> inputs{ProbeInput(channel, {})};
    inputs[0].measure_delay();
    for (int k = 0; k < 1000; ++k) {
      const nanoseconds time = k * milliseconds{1};
      inputs[0].estimate()->add({.time = time, .arrival = time + microseconds{100}});
    }
    std::atomic<std::int64_t> delay_ns{10'000'000};
    DelayControl::Shortage shortage;
    DelayControl control(delay_ns, shortage);
    const nanoseconds delay = control.step(inputs, milliseconds{1}, catches_up);
    EXPECT_NEAR(units::ms_from(delay), catches_up ? 1.12 : 9.98, 0.05);
  }
}

TEST(DelayControl, NeverStopsTheTicksAndNeverRunsThemBackToBack) {
  ProbeQueue channel{10'000};
  std::vector<ProbeInput> inputs{ProbeInput(channel, {})};
  inputs[0].measure_delay();
  std::atomic<std::int64_t> delay_ns{2'000'000};
  DelayControl::Shortage shortage;
  DelayControl control(delay_ns, shortage);
  nanoseconds time{0};
  nanoseconds before{2'000'000};
  const auto run = [&](int ticks, nanoseconds late) {
    for (int k = 0; k < ticks; ++k, time += milliseconds{1}) {
      inputs[0].estimate()->add({.time = time, .arrival = time + late});
      const nanoseconds now = control.step(inputs, milliseconds{1});
      ASSERT_LE(now - before, microseconds{500});
      ASSERT_GE(now - before, -microseconds{20});
      before = now;
    }
  };
  run(1000, microseconds{100});
  EXPECT_NEAR(units::ms_from(before), 1.12, 0.08);
  run(1000, milliseconds{40});
  EXPECT_NEAR(units::ms_from(before), 41.0, 1.5);
  EXPECT_EQ(shortage.needed_ns.load(), 0);
  run(1000, milliseconds{80});
  EXPECT_EQ(before, milliseconds{50});
  EXPECT_NEAR(units::ms_from(nanoseconds{shortage.needed_ns.load()}), 81.0, 3.0);
  // Within 10 seconds back to within 10 % of the delay before.
  run(7000, microseconds{100});
  EXPECT_NEAR(units::ms_from(before), 1.12, 0.11);
  EXPECT_EQ(shortage.needed_ns.load(), 0);
}

}  // namespace
}  // namespace merkel
