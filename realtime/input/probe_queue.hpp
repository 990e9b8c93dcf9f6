#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "core/records/readings.hpp"
#include "core/records/tick_record.hpp"
#include "realtime/queues/counter.hpp"
#include "realtime/queues/reading_ring.hpp"

namespace merkel {

/// State shared by the thread of a device and the simulation thread, for one of its probes.
struct ProbeQueue {
  /// \param the_ring  of the device. \param the_place  of the probe among those that it feeds
  ProbeQueue(std::shared_ptr<ReadingRing> the_ring, std::size_t the_place)
      : ring(std::move(the_ring)), place(the_place) {}
  /// Of a device that feeds no other probe. \param taxels  of a tactile array
  explicit ProbeQueue(std::size_t capacity, std::size_t taxels = 0)
      : ProbeQueue(
            std::make_shared<ReadingRing>(ReadingColumns(ProbeColumns{.taxels = taxels}), capacity),
            0) {}

  /// Queues a sample of a device that feeds no other probe; false when full. Thread: probe.
  [[nodiscard]] bool try_push(const ProbeSample& sample,
                              std::span<const float> taxels = {}) noexcept {
    const std::span<double> row = ring->next_row();
    if (row.empty()) return false;
    const std::span<double> to = columns().taxels_in(row);
    columns().put(sample, row);
    const bool whole = taxels.size() == to.size();
    if (whole) std::copy(taxels.begin(), taxels.end(), to.begin());
    if (!whole) std::fill(to.begin(), to.end(), 0.0);
    ring->push(head_of(sample));
    return true;
  }

  [[nodiscard]] const ProbeColumns& columns() const noexcept { return ring->columns().of(place); }
  /// The head of the oldest sample that waits, or null. Thread: simulation, here and below.
  [[nodiscard]] const ReadingHead* front() const noexcept { return ring->front(place); }
  /// That sample.
  [[nodiscard]] ProbeSample front_sample() const noexcept {
    return columns().sample(*front(), ring->front_row(place));
  }
  [[nodiscard]] std::span<const double> front_taxels() const noexcept {
    return columns().taxels_in(ring->front_row(place));
  }
  void pop() const noexcept { ring->pop(place); }

  std::shared_ptr<ReadingRing> ring;  ///< device's thread → simulation thread
  std::size_t place;
  Counter delivered;               ///< samples put into the ring
  Counter dropped;                 ///< samples dropped because the ring was full
  std::atomic<bool> ended{false};  ///< set after the last sample; none will follow
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
