#include "drivers/clock/clock_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace merkel {
namespace {

constexpr double kRobust_s = 1e-4;  ///< an offset further from the line counts less
constexpr int kMaxSteps = 200;
constexpr double kResetStep_s = 1.0;  ///< beyond the median step
constexpr double kResetGap_s = 5.0;   ///< beyond the median time between offsets

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// As pyxdf finds it: time goes back, or a large step after a gap. \param offsets  two or more
bool was_reset(const ClockOffsets& offsets) {
  std::vector<double> steps_s;
  std::vector<double> gaps_s;
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    gaps_s.push_back(offsets[i].first - offsets[i - 1].first);
    steps_s.push_back(std::fabs(offsets[i].second - offsets[i - 1].second));
  }
  const double step_s = kResetStep_s + median_of(steps_s);
  const double gap_s = kResetGap_s + median_of(gaps_s);
  for (std::size_t i = 0; i < gaps_s.size(); ++i) {
    if (gaps_s[i] < 0.0 || (steps_s[i] > step_s && gaps_s[i] > gap_s)) return true;
  }
  return false;
}

}  // namespace

Expected<ClockLine, SetupError> ClockLine::through(const ClockOffsets& offsets,
                                                   const std::string& stream) {
  if (offsets.empty()) return ClockLine{};
  if (offsets.size() == 1) return ClockLine{.offset_s = offsets[0].second};
  if (was_reset(offsets)) {
    return bad_input("the clock of " + stream +
                     " was reset during the recording, so its times have no line: read the parts "
                     "before and after with pyxdf");
  }
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
  return ClockLine{
      .offset_s = at_middle - drift * middle_s, .drift = drift, .residual_s = median_of(residuals)};
}

}  // namespace merkel
