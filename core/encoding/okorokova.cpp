#include "core/encoding/okorokova.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {

PopulationResponse okorokova_response(const std::array<double, 4>& c) noexcept {
  const std::array<double, 3> v = {c[0] - c[1], c[1] - c[2], c[2] - c[3]};
  const std::array<double, 2> a = {v[0] - v[1], v[1] - v[2]};
  const double rate_Hz = 557.9706 * c[0] - 554.7820 * c[1] + 1559.4952 * std::fabs(v[0]) -
                         359.7767 * std::fabs(v[1]) - 109.1068 * std::fabs(v[2]) +
                         364.3545 * std::fabs(a[0]) + 169.9743 * std::fabs(a[1]) - 3.1163;
  const double recruited = 181.7049 * c[0] - 164.2083 * c[1] + 527.9869 * std::fabs(v[0]) +
                           292.2716 * std::fabs(v[1]) + 6.3115 * std::fabs(a[0]) +
                           21.9826 * std::fabs(a[1]) - 2.0783;
  // Comparing in this order keeps NaN.
  return {.rate_Hz = rate_Hz < 0.0 ? 0.0 : rate_Hz, .recruited = recruited < 0.0 ? 0.0 : recruited};
}

TouchHistory::TouchHistory(std::chrono::nanoseconds tick) {
  for (std::size_t k = 0; k < lags_.size(); ++k) {
    const std::chrono::nanoseconds lag = static_cast<int>(k) * kInterval;
    lags_[k] = static_cast<std::size_t>((lag + tick / 2) / tick);
  }
  values_.resize(lags_.back() + 1);
}

void TouchHistory::reset(double value) noexcept {
  std::fill(values_.begin(), values_.end(), value);
}

void TouchHistory::push(double value) noexcept {
  newest_ = newest_ + 1 < values_.size() ? newest_ + 1 : 0;
  values_[newest_] = value;
}

std::array<double, 4> TouchHistory::at_intervals() const noexcept {
  std::array<double, 4> values{};
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::size_t wrapped = newest_ < lags_[k] ? values_.size() : 0;
    values[k] = values_[newest_ + wrapped - lags_[k]];
  }
  return values;
}

}  // namespace merkel
