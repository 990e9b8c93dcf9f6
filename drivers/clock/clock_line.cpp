#include "drivers/clock/clock_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/math/line_fit.hpp"

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
  std::vector<double> residuals(offsets.size());
  const auto index = [&](const auto& each) {
    return static_cast<std::size_t>(&each - offsets.data());
  };
  const auto x = [&](const auto& each) { return each.first - middle_s; };
  const auto y = [](const auto& each) { return each.second; };
  const auto weight = [&](const auto& each) {
    return kRobust_s / std::max(residuals[index(each)], kRobust_s);
  };
  double at_middle = 0.0;
  double drift = 0.0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const FittedLine line = fit_line(offsets, x, y, weight);
    const double before = std::exchange(at_middle, line.intercept());
    const double drift_before = std::exchange(drift, line.slope());
    for (const auto& each : offsets) residuals[index(each)] = std::fabs(y(each) - line.at(x(each)));
    if (std::fabs(at_middle - before) < 1e-13 && std::fabs(drift - drift_before) < 1e-15) break;
  }
  return ClockLine{
      .offset_s = at_middle - drift * middle_s, .drift = drift, .residual_s = median_of(residuals)};
}

}  // namespace merkel
