#pragma once

#include <chrono>
#include <vector>

#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// The current at which a Connor-Stevens neuron fires at a given rate: its inverse f–I curve
/// without noise, computed by stepping neurons at many currents at once. Rates are interpolated
/// linearly between currents that are 0.02 µA/cm² apart near the onset and up to 0.5 µA/cm² beyond.
/// Real-time: no to construct.
class RateCurrentTable {
 public:
  /// \param step  of the neurons
  RateCurrentTable(const ConnorStevens& neuron, std::chrono::nanoseconds step);

  /// \param rate_Hz  ≥ 0. Returns the resting current, slightly below the onset, for 0. Rates above
  /// the table's fastest give its largest current. Real-time: yes.
  [[nodiscard]] double current_uA_per_cm2(double rate_Hz) const noexcept MERKEL_REALTIME;
  /// The rate at a current within the table, Hz.
  [[nodiscard]] double rate_Hz(double current_uA_per_cm2) const noexcept;

  /// Whether the neuron fires steadily at some current between 7 and 60 µA/cm².
  [[nodiscard]] bool valid() const noexcept { return rate_.size() > 2; }
  [[nodiscard]] double onset_uA_per_cm2() const noexcept { return current_[1]; }

 private:
  std::vector<double> rate_;     ///< rising, from 0
  std::vector<double> current_;  ///< rising
};

}  // namespace merkel
