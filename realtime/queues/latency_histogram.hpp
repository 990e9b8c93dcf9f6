#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "core/realtime_tag.hpp"
#include "realtime/queues/counter.hpp"

namespace merkel {

/// A histogram of durations from 1 ns to 18 minutes, with a resolution of 3.1 %.
///
/// Each power of two is divided into 32 equal buckets (as in HdrHistogram, Tene 2012). Recording is
/// one increment; nothing is allocated or lost. One thread records, any thread reads, without
/// locks.
class LatencyHistogram {
 public:
  static constexpr std::size_t kBucketsAnOctave = 32;
  static constexpr std::size_t kBits = 40;  ///< longer durations fall into the last bucket
  static constexpr std::size_t kBuckets = (kBits - 4) * kBucketsAnOctave;

  /// The contents of a histogram at one moment, or the difference between two moments.
  class Snapshot {
   public:
    [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
    /// The duration that the given fraction of all durations does not exceed; 0 if there are none.
    [[nodiscard]] std::chrono::nanoseconds quantile(double fraction) const noexcept {
      if (count_ == 0) return std::chrono::nanoseconds{0};
      const double wanted = fraction * static_cast<double>(count_);
      std::uint64_t so_far = 0;
      for (std::size_t i = 0; i < kBuckets; ++i) {
        so_far += counts_[i];
        if (so_far > 0 && static_cast<double>(so_far) >= wanted) {
          return std::chrono::nanoseconds{
              static_cast<std::int64_t>(std::min(highest_of(i), longest_))};
        }
      }
      return longest();
    }
    /// The longest duration; for a difference, accurate to one bucket.
    [[nodiscard]] std::chrono::nanoseconds longest() const noexcept {
      return std::chrono::nanoseconds{static_cast<std::int64_t>(longest_)};
    }
    /// The durations recorded after an earlier snapshot of the same histogram.
    [[nodiscard]] Snapshot since(const Snapshot& earlier) const noexcept {
      Snapshot difference;
      for (std::size_t i = 0; i < kBuckets; ++i) {
        difference.counts_[i] = counts_[i] - earlier.counts_[i];
        difference.count_ += difference.counts_[i];
        if (difference.counts_[i] > 0) difference.longest_ = std::min(highest_of(i), longest_);
      }
      return difference;
    }

   private:
    friend class LatencyHistogram;
    std::array<std::uint64_t, kBuckets> counts_{};
    std::uint64_t count_ = 0;
    std::uint64_t longest_ = 0;
  };

  /// A negative duration counts as 0. Real-time: yes. Thread: the recording thread.
  void record(std::chrono::nanoseconds duration) noexcept MERKEL_REALTIME {
    const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(duration.count(), 0));
    buckets_[bucket_of(value)].add();
    longest_.raise_to(value);
  }

  /// Thread: any.
  [[nodiscard]] Snapshot snapshot() const noexcept {
    Snapshot result;
    for (std::size_t i = 0; i < kBuckets; ++i) {
      result.counts_[i] = buckets_[i].value();
      result.count_ += result.counts_[i];
    }
    result.longest_ = longest_.value();
    return result;
  }

  /// The bucket of a duration in ns, and the longest duration that falls into a bucket.
  [[nodiscard]] static constexpr std::size_t bucket_of(std::uint64_t value) noexcept {
    if (value < kBucketsAnOctave) return value;
    const auto shift = static_cast<std::size_t>(std::bit_width(value)) - 6;
    return std::min(shift * kBucketsAnOctave + (value >> shift), kBuckets - 1);
  }
  [[nodiscard]] static constexpr std::uint64_t highest_of(std::size_t bucket) noexcept {
    if (bucket < kBucketsAnOctave) return bucket;
    if (bucket == kBuckets - 1) return UINT64_MAX;
    const std::size_t shift = bucket / kBucketsAnOctave - 1;
    return ((bucket % kBucketsAnOctave + kBucketsAnOctave + 1) << shift) - 1;
  }

 private:
  std::array<Counter, kBuckets> buckets_;
  Counter longest_;
};

/// The summary of a histogram.
struct LatencySummary {
  std::uint64_t count = 0;
  std::chrono::nanoseconds p50{0};
  std::chrono::nanoseconds p99{0};
  std::chrono::nanoseconds p999{0};
  std::chrono::nanoseconds longest{0};

  [[nodiscard]] static LatencySummary of(const LatencyHistogram::Snapshot& snapshot) noexcept {
    return {.count = snapshot.count(),
            .p50 = snapshot.quantile(0.5),
            .p99 = snapshot.quantile(0.99),
            .p999 = snapshot.quantile(0.999),
            .longest = snapshot.longest()};
  }
};

}  // namespace merkel
