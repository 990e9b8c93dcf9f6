#pragma once

#include <cstddef>
#include <span>

#include "core/records/spike_event.hpp"

namespace merkel {

/// How far spike trains are from a reference.
struct SpikeTrainError {
  std::size_t matched = 0;
  std::size_t unmatched = 0;  ///< spikes of either side without a partner
  double rms_ms = 0.0;        ///< of the matched
  double median_ms = 0.0;     ///< of the matched, absolute

  [[nodiscard]] double share_unmatched() const noexcept {
    const std::size_t all = 2 * matched + unmatched;
    return all > 0 ? static_cast<double>(unmatched) / static_cast<double>(all) : 0.0;
  }
};

/// Compares neuron by neuron. Where a neuron has as many spikes on either side, they are partners
/// in order; else each spike's partner is the nearest free one within 5 ms. Both in order of time.
[[nodiscard]] SpikeTrainError spike_train_error(std::span<const SpikeEvent> spikes,
                                                std::span<const SpikeEvent> reference);

}  // namespace merkel
