#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <optional>
#include <span>

#include "core/records/probe_sample.hpp"
#include "core/records/tick_record.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/queues/counter.hpp"
#include "realtime/queues/taxel_rows.hpp"

namespace merkel {

/// State shared by the thread of one probe and the simulation thread.
struct ProbeChannel {
  /// \param taxels  of a tactile array; 0: another probe
  explicit ProbeChannel(std::size_t capacity, std::size_t taxels = 0) : samples(capacity) {
    if (taxels > 0) rows.emplace(taxels, std::min(capacity, kMostRows));
  }

  /// Queues a sample with the pressures of its array, if it is one; false when full. Thread: probe.
  [[nodiscard]] bool try_push(const ProbeSample& sample, std::span<const float> taxels) noexcept {
    if (!rows) return samples.try_push(sample);
    const std::span<float> row = rows->next();
    if (row.empty()) return false;
    const bool whole = taxels.size() == row.size();
    if (whole) std::copy(taxels.begin(), taxels.end(), row.begin());
    if (!whole) std::fill(row.begin(), row.end(), 0.0F);
    if (!samples.try_push(sample)) return false;
    rows->push();
    return true;
  }

  static constexpr std::size_t kMostRows = 8192;
  BoundedQueue<ProbeSample> samples;  ///< probe thread → simulation thread
  std::optional<TaxelRows> rows;      ///< those of a tactile array, beside the samples
  Counter delivered;                  ///< samples put into the queue
  Counter dropped;                    ///< samples dropped because the queue was full
  std::atomic<bool> ended{false};     ///< set after the last sample; none will follow
  /// Host time of the newest sample: its acquisition, at the latest its arrival.
  std::atomic<std::int64_t> newest_ns{0};

  /// Counted by the simulation thread.
  Counter used;        ///< samples that had arrived when their time was simulated
  Counter late;        ///< samples whose time had already been simulated
  Counter held_ticks;  ///< readings for which the last sample was held
  /// The press of the last tick, for display. Written by the simulation thread.
  std::atomic<double> depth_mm{0.0};
  std::atomic<double> force_mN{0.0};
  std::atomic<std::int64_t> touch_ns{0};  ///< the length of the touch so far; 0: none
  std::atomic<TickRecord::State> state{TickRecord::State::kFollowing};
  Counter released_ticks;  ///< readings without contact because the probe was silent for too long
};

}  // namespace merkel
