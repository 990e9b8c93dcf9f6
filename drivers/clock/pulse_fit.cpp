#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "drivers/clock/pulse_match.hpp"

namespace merkel {
namespace {

constexpr std::size_t kNeighbours = 64;  ///< pulses
constexpr std::size_t kMaxKnots = 64;

/// Drops pairs that are farther from the line through their neighbours than nearly all others.
void drop_outliers(std::vector<ClockReading>& pairs) {
  std::vector<double> errors;
  for (std::size_t begin = 0; begin < pairs.size(); begin += kNeighbours) {
    const auto first = pairs.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last =
        pairs.begin() + static_cast<std::ptrdiff_t>(std::min(begin + kNeighbours, pairs.size()));
    std::vector<std::pair<double, double>> points;
    for (auto each = first; each != last; ++each) {
      const auto since = each->from - first->from;
      points.emplace_back(static_cast<double>(since.count()),
                          static_cast<double>((each->to - first->to - since).count()));
    }
    double mean_x = 0.0;
    double mean_y = 0.0;
    for (const auto& [x, y] : points) {
      mean_x += x / static_cast<double>(points.size());
      mean_y += y / static_cast<double>(points.size());
    }
    double xx = 0.0;
    double xy = 0.0;
    for (const auto& [x, y] : points) {
      xx += (x - mean_x) * (x - mean_x);
      xy += (x - mean_x) * (y - mean_y);
    }
    for (const auto& [x, y] : points) {
      errors.push_back(std::fabs(y - mean_y - (xx > 0.0 ? xy / xx : 0.0) * (x - mean_x)));
    }
  }
  std::vector<double> sorted = errors;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  constexpr double kFar = 8.0;         // of the median
  constexpr double kAlwaysNear = 2e3;  // ns
  const double most = std::max(kFar * *middle, kAlwaysNear);
  std::size_t i = 0;
  std::erase_if(pairs, [&](const ClockReading&) { return errors[i++] > most; });
}

/// Means of neighbouring pairs, few enough for a fit.
std::vector<ClockReading> knots_of(const std::vector<ClockReading>& pairs) {
  const std::size_t size = std::clamp<std::size_t>(pairs.size() / kMaxKnots, 1, kNeighbours);
  std::vector<ClockReading> knots;
  const std::size_t count = pairs.size() / size;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t begin = k * pairs.size() / count;
    const std::size_t end = (k + 1) * pairs.size() / count;
    ClockReading sum{};
    for (std::size_t i = begin; i < end; ++i) {
      sum.from += pairs[i].from - pairs[begin].from;
      sum.to += pairs[i].to - pairs[begin].to;
    }
    const auto of = static_cast<std::int64_t>(end - begin);
    knots.push_back(
        {.from = pairs[begin].from + sum.from / of, .to = pairs[begin].to + sum.to / of});
  }
  return knots;
}

}  // namespace

ClockFit fit_pulses(PulseMatch& match, std::chrono::nanoseconds first,
                    std::chrono::nanoseconds last) {
  drop_outliers(match.pairs);
  ClockFit fit = fit_clocks(knots_of(match.pairs), first, last);
  for (const ClockReading& each : match.pairs) {
    match.residuals.push_back(fit.map(each.from) - each.to);
  }
  return fit;
}

}  // namespace merkel
