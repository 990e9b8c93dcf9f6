#include "core/encoding/charge_window.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {

using std::chrono::nanoseconds;

// A limit beyond all numbers of whole femtocoulombs is none.
ChargeWindow::ChargeWindow(double max_nC_per_s, nanoseconds shortest)
    : pulses_(static_cast<std::size_t>(std::chrono::seconds{1} /
                                       std::max(shortest, nanoseconds{1'000})) +
              2),
      max_charge_fC_(static_cast<std::int64_t>(std::min(max_nC_per_s * 1e6, 0x1.0p62))) {}

void ChargeWindow::reset() noexcept {
  count_ = 0;
  charge_fC_ = 0;
}

bool ChargeWindow::takes(nanoseconds time, double amplitude_uA, nanoseconds phase) noexcept {
  while (count_ > 0) {
    const auto& [oldest, charge_fC] = pulses_[oldest_];
    if (time - oldest < std::chrono::seconds{1}) break;
    charge_fC_ -= charge_fC;
    oldest_ = (oldest_ + 1) % pulses_.size();
    --count_;
  }
  // µA·ns is fC.
  const auto charge =
      static_cast<std::int64_t>(std::ceil(amplitude_uA * static_cast<double>(phase.count())));
  if (count_ == pulses_.size() || charge_fC_ + charge > max_charge_fC_) return false;
  pulses_[(oldest_ + count_) % pulses_.size()] = {time, charge};
  charge_fC_ += charge;
  ++count_;
  return true;
}

}  // namespace merkel
