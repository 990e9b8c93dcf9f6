#include "drivers/clock/envelope_line.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/math/line_fit.hpp"

namespace merkel {
namespace {

constexpr double kMaxSlope = 0.02;  ///< between any two oscillators
constexpr double kHeldUp = 4.0;     ///< times the median distance
constexpr std::size_t kMinForLone = 4;
constexpr double kLoneLow_ns = 10e6;
constexpr double kMinHeldUp_ns = 20'000.0;  ///< below: noise of any transport

bool turns_up(const EnvelopePoint& a, const EnvelopePoint& b, const EnvelopePoint& c) {
  return (b.y_ns - a.y_ns) * (c.x_ns - b.x_ns) < (c.y_ns - b.y_ns) * (b.x_ns - a.x_ns);
}

std::vector<EnvelopePoint> lower_hull(std::span<const EnvelopePoint> points) {
  std::vector<EnvelopePoint> hull;
  for (const EnvelopePoint& point : points) {
    while (hull.size() > 1 && !turns_up(hull[hull.size() - 2], hull.back(), point)) hull.pop_back();
    hull.push_back(point);
  }
  return hull;
}

/// Slope of the hull's edge below the points' mean x, which is closest to all points; empty if no
/// clock can have this slope.
std::optional<double> hull_slope(std::span<const EnvelopePoint> points) {
  const std::vector<EnvelopePoint> hull = lower_hull(points);
  double mean_ns = 0.0;
  for (const EnvelopePoint& point : points) {
    mean_ns += point.x_ns / static_cast<double>(points.size());
  }
  for (std::size_t i = 1; i < hull.size(); ++i) {
    if (hull[i].x_ns < mean_ns) continue;
    const double slope = (hull[i].y_ns - hull[i - 1].y_ns) / (hull[i].x_ns - hull[i - 1].x_ns);
    return std::fabs(slope) <= kMaxSlope ? std::optional(slope) : std::nullopt;
  }
  return std::nullopt;
}

/// The points without one that is far below all others: a frame can be late but never early, so its
/// device time was wrong. The newest one stays: it may be the first on time after a stall.
std::vector<EnvelopePoint> without_lone_low(std::span<const EnvelopePoint> points, double slope) {
  std::vector<EnvelopePoint> rest(points.begin(), points.end());
  if (rest.size() < kMinForLone) return rest;
  const auto height = [slope](const EnvelopePoint& point) {
    return point.y_ns - slope * point.x_ns;
  };
  const auto lower = [&](const EnvelopePoint& a, const EnvelopePoint& b) {
    return height(a) < height(b);
  };
  const auto lowest = std::min_element(rest.begin(), rest.end(), lower);
  std::vector<EnvelopePoint> others = rest;
  others.erase(others.begin() + (lowest - rest.begin()));
  if (lowest == rest.end() - 1) return rest;
  const auto next = std::min_element(others.begin(), others.end(), lower);
  return height(*next) - height(*lowest) > kLoneLow_ns ? others : rest;
}

EnvelopeLine least_squares(std::span<const EnvelopePoint> points, double otherwise) {
  const FittedLine fitted = fit_line(
      points, [](const auto& point) { return point.x_ns; },
      [](const auto& point) { return point.y_ns; });
  EnvelopeLine line;
  line.slope = points.size() > 2 && fitted.xx > 0.0 ? fitted.slope() : otherwise;
  line.intercept_ns = fitted.mean_y - line.slope * fitted.mean_x;
  double squares = 0.0;
  for (const EnvelopePoint& point : points) {
    const double rest = point.y_ns - line.intercept_ns - line.slope * point.x_ns;
    squares += rest * rest / fitted.count;
  }
  line.rms_ns = std::sqrt(squares);
  return line;
}

}  // namespace

EnvelopeLine fit_envelope(std::span<const EnvelopePoint> all, double slope) {
  const std::vector<EnvelopePoint> points = without_lone_low(all, slope);
  const std::optional<double> hull = hull_slope(points);
  const double below = hull.value_or(slope);
  const auto height = [below](const EnvelopePoint& point) {
    return point.y_ns - below * point.x_ns;
  };
  std::vector<double> heights;
  for (const EnvelopePoint& point : points) heights.push_back(height(point));
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  const double lowest = *std::min_element(heights.begin(), heights.end());
  if (!hull) return {.intercept_ns = lowest, .slope = slope, .rms_ns = *middle - lowest};
  const double highest = lowest + std::max(kHeldUp * (*middle - lowest), kMinHeldUp_ns);
  std::vector<EnvelopePoint> good;
  std::copy_if(points.begin(), points.end(), std::back_inserter(good),
               [&](const EnvelopePoint& point) { return height(point) <= highest; });
  return least_squares(good, below);
}

}  // namespace merkel
