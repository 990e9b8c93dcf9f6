#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/spike_event.hpp"

namespace merkel {

/// The spikes of one tick, in memory reserved beforehand. Real-time: yes, after construction.
class SpikeBuffer {
 public:
  explicit SpikeBuffer(std::size_t capacity) : events_(capacity) {}

  /// Refuses and counts when full.
  void push(const SpikeEvent& event) noexcept MERKEL_REALTIME {
    if (size_ < events_.size()) {
      events_[size_++] = event;
    } else {
      ++refused_;
    }
  }
  void clear() noexcept MERKEL_REALTIME { size_ = 0; }
  void sort() noexcept MERKEL_REALTIME {
    std::sort(begin(), begin() + static_cast<std::ptrdiff_t>(size_));
  }
  [[nodiscard]] std::span<const SpikeEvent> events() const noexcept {
    return {events_.data(), size_};
  }
  [[nodiscard]] std::span<SpikeEvent> events() noexcept { return {events_.data(), size_}; }
  /// Spikes that found no room, since construction.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  std::vector<SpikeEvent>::iterator begin() noexcept { return events_.begin(); }
  std::vector<SpikeEvent> events_;
  std::size_t size_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace merkel
