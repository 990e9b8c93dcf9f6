#pragma once

#include <utility>
#include <vector>

namespace merkel {

/// A clock as offset + drift·t, by a robust line through measured offsets, as pyxdf fits it.
struct ClockLine {
  double offset_s = 0.0;
  double drift = 0.0;
  double residual_s = 0.0;  ///< median; 0 with fewer than two offsets

  /// \param offsets  instants and offsets, in s
  [[nodiscard]] static ClockLine through(const std::vector<std::pair<double, double>>& offsets);
  [[nodiscard]] double operator()(double time_s) const noexcept {
    return time_s + offset_s + drift * time_s;
  }
};

}  // namespace merkel
