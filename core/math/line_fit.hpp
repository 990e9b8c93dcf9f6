#pragma once

#include <cstddef>
#include <span>

namespace merkel {

/// y = intercept + slope·x.
struct FittedLine {
  double intercept = 0.0;
  double slope = 0.0;
};

/// The least-squares line through points.
/// \param x  at least two different values
/// \param y  as many
[[nodiscard]] inline FittedLine fit_line(std::span<const double> x, std::span<const double> y) {
  const auto count = static_cast<double>(x.size());
  double mean_x = 0.0;
  double mean_y = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / count;
    mean_y += y[i] / count;
  }
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  const double slope = xy / xx;
  return {.intercept = mean_y - slope * mean_x, .slope = slope};
}

}  // namespace merkel
