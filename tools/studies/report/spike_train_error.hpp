#pragma once

#include <cstddef>
#include <span>

#include "core/records/spike_event.hpp"

namespace merkel {

/// The deviation of spike trains from a reference.
struct SpikeTrainError {
  std::size_t matched = 0;
  std::size_t unmatched = 0;  ///< spikes without a partner on either side
  double rms_ms = 0.0;        ///< of matched spikes
  double median_ms = 0.0;     ///< of matched spikes, absolute

  [[nodiscard]] double share_unmatched() const noexcept {
    const std::size_t all = 2 * matched + unmatched;
    return all > 0 ? static_cast<double>(unmatched) / static_cast<double>(all) : 0.0;
  }
};

/// Compares neuron by neuron. If a neuron has the same number of spikes on both sides, they are
/// matched in order; otherwise each spike is matched with the nearest free one within 5 ms. Both in
/// order of time.
[[nodiscard]] SpikeTrainError spike_train_error(std::span<const SpikeEvent> spikes,
                                                std::span<const SpikeEvent> reference);

}  // namespace merkel
