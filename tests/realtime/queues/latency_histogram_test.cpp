#include "realtime/queues/latency_histogram.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "realtime/loop/loop_statistics.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;
using Histogram = LatencyHistogram;

TEST(LatencyHistogram, BucketsFollowEachOtherWithoutGapOrOverlap) {
  EXPECT_EQ(Histogram::bucket_of(0), 0U);
  for (std::size_t i = 0; i + 1 < Histogram::kBuckets; ++i) {
    EXPECT_EQ(Histogram::bucket_of(Histogram::highest_of(i)), i);
    EXPECT_EQ(Histogram::bucket_of(Histogram::highest_of(i) + 1), i + 1);
  }
  EXPECT_EQ(Histogram::bucket_of(UINT64_MAX), Histogram::kBuckets - 1);
}

TEST(LatencyHistogram, ABucketIsAtMostThreePercentWide) {
  for (std::size_t i = Histogram::kBucketsAnOctave; i + 1 < Histogram::kBuckets; ++i) {
    const auto low = static_cast<double>(Histogram::highest_of(i - 1) + 1);
    const auto high = static_cast<double>(Histogram::highest_of(i));
    EXPECT_LE((high - low) / low, 1.0 / 32.0);
  }
}

TEST(LatencyHistogram, QuantilesMatchTheSortedDurations) {
  Histogram histogram;
  Random random(7);
  std::vector<std::int64_t> all;
  for (int i = 0; i < 10'000; ++i) {
    // Durations over seven decades.
    std::int64_t value = 10;
    const auto decade = static_cast<int>(7.0 * random.uniform());
    for (int k = 0; k < decade; ++k) value *= 10;
    all.push_back(value + static_cast<std::int64_t>(random.uniform() * static_cast<double>(value)));
    histogram.record(nanoseconds{all.back()});
  }
  std::sort(all.begin(), all.end());
  const auto snapshot = histogram.snapshot();
  EXPECT_EQ(snapshot.count(), all.size());
  EXPECT_EQ(snapshot.longest().count(), all.back());
  EXPECT_EQ(snapshot.quantile(1.0).count(), all.back());
  for (const double fraction : {0.001, 0.1, 0.5, 0.9, 0.99, 0.999}) {
    const auto rank = static_cast<std::size_t>(fraction * 10'000.0) - 1;
    const auto exact = static_cast<double>(all[rank]);
    const auto reported = static_cast<double>(snapshot.quantile(fraction).count());
    EXPECT_GE(reported, exact) << fraction;
    EXPECT_LE(reported, exact * 1.032 + 1.0) << fraction;
  }
}

TEST(LatencyHistogram, ASummaryHasItsQuantiles) {
  LatencyHistogram histogram;
  for (int k = 1; k <= 2000; ++k) histogram.record(nanoseconds{1000 * k});
  const auto summary = LatencySummary::of(histogram.snapshot());
  EXPECT_EQ(summary.count, 2000U);
  EXPECT_NEAR(static_cast<double>(summary.p50.count()), 1000e3, 35e3);
  EXPECT_NEAR(static_cast<double>(summary.p99.count()), 1980e3, 10e3 + 0.03 * 1980e3);
  EXPECT_GE(summary.p999, summary.p99);
  EXPECT_EQ(summary.longest.count(), 2'000'000);
}

TEST(LatencyHistogram, NothingIsTooShortOrTooLong) {
  Histogram histogram;
  EXPECT_EQ(histogram.snapshot().quantile(0.5), nanoseconds{0});
  histogram.record(nanoseconds{-5});
  histogram.record(std::chrono::hours{100});
  const auto snapshot = histogram.snapshot();
  EXPECT_EQ(snapshot.count(), 2U);
  EXPECT_EQ(snapshot.quantile(0.5), nanoseconds{0});
  EXPECT_EQ(snapshot.quantile(1.0), std::chrono::hours{100});
}

TEST(LatencyHistogram, SubtractsAnEarlierSnapshot) {
  Histogram histogram;
  for (int i = 0; i < 1000; ++i) histogram.record(std::chrono::milliseconds{5});
  const auto earlier = histogram.snapshot();
  for (int i = 0; i < 10; ++i) histogram.record(nanoseconds{100});
  const auto since = histogram.snapshot().since(earlier);
  EXPECT_EQ(since.count(), 10U);
  EXPECT_GE(since.longest(), nanoseconds{100});
  EXPECT_LE(since.longest(), nanoseconds{104});
}

TEST(LatencyHistogram, CanBeReadWhileItIsWritten) {
  Histogram histogram;
  constexpr std::uint64_t kAll = 100'000;
  std::jthread writer([&histogram] {
    for (std::uint64_t i = 0; i < kAll; ++i) histogram.record(nanoseconds{i});
  });
  std::uint64_t before = 0;
  while (before < kAll) {
    const std::uint64_t count = histogram.snapshot().count();
    ASSERT_GE(count, before);
    before = count;
    std::this_thread::yield();
  }
  EXPECT_EQ(before, kAll);
}

TEST(RecentLatency, LeavesOutWhatIsOlderThanTenSeconds) {
  using std::chrono::seconds;
  LoopStatistics statistics;
  RecentLatency recent;
  const auto present = [&] {
    return LatencySummary::of(statistics.sample_to_spike.snapshot().since(recent.before().spike));
  };
  for (seconds now{100}; now < seconds{130}; now += seconds{1}) {
    recent.look(statistics, now);
    const bool earlier = now < seconds{115};
    statistics.sample_to_spike.record(earlier ? nanoseconds{1'000'000'000}
                                              : nanoseconds{2'000'000});
  }
  EXPECT_GE(present().count, 5U);
  EXPECT_LE(present().count, 10U);
  EXPECT_LT(present().longest, std::chrono::milliseconds{3});
}

}  // namespace
}  // namespace merkel
