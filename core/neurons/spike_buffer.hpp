#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/spike_event.hpp"

namespace merkel {

/// The spikes of one tick, in preallocated memory. Real-time: yes, after construction.
class SpikeBuffer {
 public:
  explicit SpikeBuffer(std::size_t capacity) : events_(capacity) {}

  /// Adds an event; when full, drops and counts it. Thread: several at a time; their events are in
  /// no particular order.
  void push(const SpikeEvent& event) noexcept MERKEL_REALTIME {
    const std::size_t place = std::atomic_ref(pushed_).fetch_add(1, std::memory_order_relaxed);
    if (place < events_.size()) events_[place] = event;
  }
  /// Adds the events of another, and counts those that it dropped since clear().
  void append(const SpikeBuffer& other) noexcept MERKEL_REALTIME {
    for (const SpikeEvent& event : other.events()) push(event);
    refused_ += other.pushed_ - other.events().size();
  }
  void clear() noexcept MERKEL_REALTIME {
    refused_ = refused();
    pushed_ = 0;
  }
  void sort() noexcept MERKEL_REALTIME { std::sort(events().begin(), events().end()); }
  [[nodiscard]] std::span<const SpikeEvent> events() const noexcept {
    return std::span(events_).first(std::min(pushed_, events_.size()));
  }
  [[nodiscard]] std::span<SpikeEvent> events() noexcept {
    return std::span(events_).first(std::min(pushed_, events_.size()));
  }
  /// Spikes dropped since construction because the buffer was full.
  [[nodiscard]] std::uint64_t refused() const noexcept {
    return refused_ + (pushed_ - events().size());
  }

 private:
  std::vector<SpikeEvent> events_;
  std::size_t pushed_ = 0;     ///< since clear(), including dropped events
  std::uint64_t refused_ = 0;  ///< before clear(), and by those appended
};

}  // namespace merkel
