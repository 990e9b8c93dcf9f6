#include "drivers/clock/clock_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace merkel {
namespace {

constexpr double kRobust_s = 1e-4;  ///< an offset further from the line counts less
constexpr int kMaxSteps = 200;

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

ClockLine ClockLine::through(const std::vector<std::pair<double, double>>& offsets) {
  if (offsets.empty()) return {};
  if (offsets.size() == 1) return {.offset_s = offsets[0].second};
  double middle_s = offsets[0].first;
  for (const auto& [time_s, offset_s] : offsets) middle_s = std::min(middle_s, time_s);
  std::vector<double> weights(offsets.size(), 1.0);
  std::vector<double> residuals(offsets.size());
  double at_middle = 0.0;
  double drift = 0.0;
  for (int step = 0; step < kMaxSteps; ++step) {
    double w = 0.0;
    double wx = 0.0;
    double wy = 0.0;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      w += weights[i];
      wx += weights[i] * (offsets[i].first - middle_s);
      wy += weights[i] * offsets[i].second;
    }
    double xx = 0.0;
    double xy = 0.0;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      const double x = offsets[i].first - middle_s - wx / w;
      xx += weights[i] * x * x;
      xy += weights[i] * x * (offsets[i].second - wy / w);
    }
    const double before = at_middle;
    const double drift_before = drift;
    drift = xx > 0.0 ? xy / xx : 0.0;
    at_middle = wy / w - drift * wx / w;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      residuals[i] =
          std::fabs(offsets[i].second - at_middle - drift * (offsets[i].first - middle_s));
      weights[i] = kRobust_s / std::max(residuals[i], kRobust_s);
    }
    if (std::fabs(at_middle - before) < 1e-13 && std::fabs(drift - drift_before) < 1e-15) break;
  }
  return {
      .offset_s = at_middle - drift * middle_s, .drift = drift, .residual_s = median_of(residuals)};
}

}  // namespace merkel
