#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/realtime_tag.hpp"

namespace merkel {

/// The charge of the pulses of a group of electrodes in the last second, on one clock.
///
/// Whole femtocoulombs, each pulse rounded up, so that the sum never drifts. Thread: one.
class ChargeWindow {
 public:
  /// \param max_nC_per_s  of one phase of each pulse, in any second; infinity for no limit
  /// \param shortest  between two pulses: what is closer may be refused
  ChargeWindow(double max_nC_per_s, std::chrono::nanoseconds shortest);

  void reset() noexcept MERKEL_REALTIME;

  /// Whether the charge of the last second allows a pulse, which then counts. Deterministic.
  /// \param time  not before that of earlier pulses
  [[nodiscard]] bool takes(std::chrono::nanoseconds time, double amplitude_uA,
                           std::chrono::nanoseconds phase) noexcept MERKEL_REALTIME;

 private:
  std::vector<std::pair<std::chrono::nanoseconds, std::int64_t>> pulses_;  ///< a ring; charge in fC
  std::size_t oldest_ = 0;
  std::size_t count_ = 0;
  std::int64_t charge_fC_ = 0;
  std::int64_t max_charge_fC_;
};

}  // namespace merkel
