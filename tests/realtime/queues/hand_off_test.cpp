// The hand-off between threads under random scheduling: first the protocol, in a model where a
// seeded scheduler draws every step and every memory delay; then the queues themselves, with
// threads that pause at random.
#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/input/probe_queue.hpp"
#include "realtime/queues/reading_ring.hpp"
#include "tests/realtime/queues/hand_off_model.hpp"

namespace merkel {
namespace {

constexpr int kSchedules = 3000;

/// The number of random schedules that violate the guarantees of the hand-off: every item arrives
/// once, in order and as written, and the reader sees the end after the last item.
int broken(const HandOffModel::Protocol& protocol) {
  int count = 0;
  for (int seed = 0; seed < kSchedules; ++seed) {
    const int items = 1 + seed % 17;
    const int capacity = 1 + seed % 5;
    const auto outcome =
        HandOffModel(protocol, items, capacity, static_cast<std::uint64_t>(seed)).run();
    bool right = outcome.finished;
    right = right && static_cast<int>(outcome.taken.size()) + outcome.dropped == items;
    int before = -1;
    for (const int item : outcome.taken) {
      right = right && item > before;
      before = item;
    }
    if (protocol.waits_when_full) right = right && outcome.dropped == 0;
    if (!right) ++count;
  }
  return count;
}

TEST(HandOff, NoScheduleBreaksTheProtocol) {
  EXPECT_EQ(broken({}), 0);
  EXPECT_EQ(broken({.waits_when_full = false}), 0);
}

TEST(HandOff, EveryPartOfTheProtocolIsNeeded) {
  EXPECT_GT(broken({.reads_flag_first = false}), 0);
  EXPECT_GT(broken({.releases_items = false}), 0);
  EXPECT_GT(broken({.releases_flag = false}), 0);
}

/// Two threads that yield at random points share the queue and flag of a probe.
TEST(HandOff, AProbesSamplesAreEachCountedOnceUnderRandomScheduling) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    constexpr int kSamples = 2000;
    ProbeQueue channel(64);
    std::jthread writer([&channel, seed] {
      Random random(seed);
      for (int k = 1; k <= kSamples; ++k) {
        const ProbeSample sample{.time = std::chrono::microseconds{100 * k},
                                 .depth_mm = 1.0,
                                 .channels = ProbeSample::kDepth};
        (channel.try_push(sample) ? channel.delivered : channel.dropped).add();
        if (random.uniform() < 0.2) std::this_thread::yield();
      }
      channel.ended.store(true, std::memory_order_release);
    });
    ProbeInput input(channel, {});
    Random random(seed + 1000);
    std::chrono::nanoseconds time{0};
    while (!input.exhausted()) {
      time += std::chrono::microseconds{static_cast<std::int64_t>(400.0 * random.uniform()) + 1};
      static_cast<void>(input.at(time));
      if (random.uniform() < 0.3) std::this_thread::yield();
    }
    writer.join();
    EXPECT_EQ(channel.delivered.value() + channel.dropped.value(), std::uint64_t{kSamples});
    EXPECT_EQ(input.counts().used + input.counts().late, channel.delivered.value());
  }
}

/// Reads a probe while a sample arrives, in each round.
/// \param read  called with the time of the sample until the sample is taken
void read_while_samples_arrive(int rounds, ProbeInput& input, ProbeQueue& channel,
                               const auto& read) {
  std::atomic<int> asked{0};
  std::jthread writer([&] {
    for (int k = 1; k <= rounds; ++k) {
      while (asked.load() != k) std::this_thread::yield();
      EXPECT_TRUE(channel.try_push({.time = std::chrono::milliseconds{k},
                                    .depth_mm = k % 2 == 0 ? 1.0 : 2.0,
                                    .channels = ProbeSample::kDepth}));
    }
  });
  for (int k = 1; k <= rounds; ++k) {
    const std::chrono::nanoseconds time = std::chrono::milliseconds{k};
    asked.store(k);
    while (input.last_time() != time) read(time);
  }
}

TEST(HandOff, ATickIsNotReadyBeforeASampleBeyondIt) {
  ProbeQueue channel(64);
  ProbeInput input(channel, {});
  int ready = 0;
  read_while_samples_arrive(2000, input, channel, [&](std::chrono::nanoseconds time) {
    if (input.ready_for(time)) ++ready;
  });
  EXPECT_EQ(ready, 0);
}

TEST(HandOff, ASampleOfAPassedTimeThatArrivesDuringAReadingIsNoSampleBeyondIt) {
  ProbeQueue channel(64);
  ProbeInput input(channel, {});
  int outside = 0;
  std::chrono::nanoseconds now{0};
  read_while_samples_arrive(2000, input, channel, [&](std::chrono::nanoseconds time) {
    now = std::max(now, time) + std::chrono::nanoseconds{100};
    const double depth_mm = input.at(now).contact.depth_mm;
    if (input.last_time() && !(depth_mm == 1.0 || depth_mm == 2.0)) ++outside;
  });
  EXPECT_EQ(outside, 0);
}

// A probe without a value for a while neither waits nor keeps the others from the ring.
TEST(ReadingRing, EachProbeTakesTheReadingsInWhichItWasMeasured) {
  ReadingRing ring(ReadingColumns(std::vector<ProbeColumns>{{.further = 1}, {.taxels = 2}}), 4);
  const auto push = [&](int number, bool first, bool second) {
    std::vector<double> row(ring.columns().width(), number);
    if (!first) ring.columns().of(0).put_nothing(row);
    if (!second) ring.columns().of(1).put_nothing(row);
    return ring.try_push({.sequence = static_cast<std::uint32_t>(number)}, row);
  };
  const auto take = [&](std::size_t probe) -> int {
    const ReadingHead* const head = ring.front(probe);
    if (head == nullptr) return -1;
    EXPECT_EQ(ring.columns().of(probe).sample(*head, ring.front_row(probe)).force_mN,
              static_cast<double>(head->sequence));
    const auto number = static_cast<int>(head->sequence);
    ring.pop(probe);
    return number;
  };
  for (const int k : {0, 1, 2, 3}) EXPECT_TRUE(push(k, true, k == 2));
  EXPECT_FALSE(push(4, true, true)) << "full";
  EXPECT_EQ(take(0), 0);
  EXPECT_FALSE(push(4, true, true)) << "the other probe has not looked";
  EXPECT_EQ(take(1), 2);
  EXPECT_EQ(ring.size_approx(), 3U);
  EXPECT_TRUE(push(4, false, true));
  EXPECT_EQ(take(1), 4);
  EXPECT_EQ(take(1), -1);
  for (const int k : {1, 2, 3, -1}) EXPECT_EQ(take(0), k);
  EXPECT_EQ(ring.size_approx(), 0U);
}

}  // namespace
}  // namespace merkel
