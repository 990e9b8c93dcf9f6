#pragma once

#include <cmath>
#include <limits>

namespace merkel {

/// Bridges the readings in which a taxel has no value: its last one stands for up to three. Then it
/// is out until it has values again.
class TaxelGap {
 public:
  static constexpr int kMax = 3;  ///< readings

  /// \param value  NaN if it is missing. \return NaN if the taxel is out
  double take(double value) noexcept {
    if (std::isfinite(value)) {
      missing_ = 0;
      return last_ = value;
    }
    if (missing_ < kMax) {
      ++missing_;
      return last_;
    }
    return last_ = std::numeric_limits<double>::quiet_NaN();
  }

 private:
  double last_ = std::numeric_limits<double>::quiet_NaN();
  int missing_ = 0;
};

}  // namespace merkel
