#pragma once

#include <chrono>
#include <cstdint>
#include <tuple>
#include <type_traits>

namespace merkel {

/// One spike of one afferent: plain data that crosses threads.
struct SpikeEvent {
  /// Conditions under which the spike occurred.
  enum Flag : std::uint16_t {
    kInputHeld = 1U << 0U,   ///< the probe's last sample was held: none had arrived in time
    kAfterReset = 1U << 1U,  ///< the neuron was reset to rest within the same tick
  };

  std::chrono::nanoseconds time{0};  ///< probe time of the crossing, within the membrane step
  std::uint32_t neuron = 0;          ///< number in the model, across all patches, from 1
  std::uint16_t patch = 0;           ///< number of the patch, from 0
  std::uint16_t flags = 0;           ///< Flag bits

  /// Order by time, then patch, then neuron: the order in which spikes are published.
  friend bool operator<(const SpikeEvent& a, const SpikeEvent& b) noexcept {
    return std::tie(a.time, a.patch, a.neuron) < std::tie(b.time, b.patch, b.neuron);
  }
  friend bool operator==(const SpikeEvent&, const SpikeEvent&) = default;
};

static_assert(std::is_trivially_copyable_v<SpikeEvent>);
static_assert(sizeof(SpikeEvent) == 16);

}  // namespace merkel
