#pragma once

#include <chrono>
#include <vector>

#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// Which current makes a Connor-Stevens neuron fire at a wanted rate: its f–I curve without noise,
/// computed by stepping neurons under many currents at once, turned around. Rates are linear
/// between currents 0.02 µA/cm² apart near the onset, up to 0.5 beyond. Real-time: no to construct.
class RateCurrentTable {
 public:
  /// \param step  with which the neurons will be stepped
  RateCurrentTable(const ConnorStevens& neuron, std::chrono::nanoseconds step);

  /// \param rate_Hz  ≥ 0; 0 gives the resting current, a little below the onset; above the
  ///                 fastest rate in the table, its current.  Real-time: yes.
  [[nodiscard]] double current_uA_per_cm2(double rate_Hz) const noexcept MERKEL_REALTIME;
  /// The rate at a current within the table, Hz.
  [[nodiscard]] double rate_Hz(double current_uA_per_cm2) const noexcept;

  /// Whether the neuron fires steadily under any current from 7 to 60 µA/cm².
  [[nodiscard]] bool valid() const noexcept { return rate_.size() > 2; }
  [[nodiscard]] double onset_uA_per_cm2() const noexcept { return current_[1]; }

 private:
  std::vector<double> rate_;     ///< rising, from 0
  std::vector<double> current_;  ///< rising
};

}  // namespace merkel
