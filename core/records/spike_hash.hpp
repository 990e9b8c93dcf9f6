#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/records/spike_event.hpp"

namespace merkel {

/// A hash of a spike train, by which runs are compared: 64-bit FNV-1a (Fowler, Noll and Vo) over
/// the spikes in order, each as its time in ns (int64) and its neuron (uint32), little-endian.
class SpikeHash {
 public:
  void add(std::int64_t time_ns, std::uint32_t neuron) noexcept {
    add_bytes(static_cast<std::uint64_t>(time_ns), 8);
    add_bytes(neuron, 4);
  }
  void add(std::span<const SpikeEvent> spikes) noexcept {
    for (const SpikeEvent& spike : spikes) add(spike.time.count(), spike.neuron);
  }
  /// Adds a text, for the hash of what determines a run.
  void add(const std::string& text) noexcept {
    for (const char c : text) add_bytes(static_cast<unsigned char>(c), 1);
    add_bytes(text.size(), 8);
  }

  /// Sixteen hexadecimal digits.
  [[nodiscard]] std::string text() const {
    std::string digits;
    for (int shift = 60; shift >= 0; shift -= 4) {
      digits.push_back("0123456789abcdef"[(hash_ >> static_cast<unsigned>(shift)) & 15U]);
    }
    return digits;
  }

 private:
  void add_bytes(std::uint64_t value, int count) noexcept {
    for (int i = 0; i < count; ++i, value >>= 8U) hash_ = (hash_ ^ (value & 255U)) * 0x100000001b3U;
  }
  std::uint64_t hash_ = 0xcbf29ce484222325U;
};

}  // namespace merkel
