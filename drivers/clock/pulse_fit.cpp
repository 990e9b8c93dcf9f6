#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/line_fit.hpp"
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
    const auto x = [&](const ClockReading& pair) {
      return static_cast<double>((pair.from - first->from).count());
    };
    const auto y = [&](const ClockReading& pair) {
      return static_cast<double>((pair.to - first->to - (pair.from - first->from)).count());
    };
    const std::span near(first, last);
    const FittedLine line = fit_line(near, x, y);
    for (const ClockReading& pair : near) {
      errors.push_back(std::fabs(y(pair) - line.at(x(pair))));
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
