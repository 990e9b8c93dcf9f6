#pragma once

namespace merkel {

/// The line of least squares through points, and the sums that it is of.
struct FittedLine {
  double count = 0.0;  ///< sum of the weights
  double mean_x = 0.0;
  double mean_y = 0.0;
  double xx = 0.0;  ///< weighted sums of products of distances from the means
  double xy = 0.0;
  double yy = 0.0;

  /// Zero if all x are equal.
  [[nodiscard]] double slope() const { return xx > 0.0 ? xy / xx : 0.0; }
  [[nodiscard]] double intercept() const { return mean_y - slope() * mean_x; }
  [[nodiscard]] double at(double x) const { return intercept() + slope() * x; }
};

/// \param points  at least one, of any kind
/// \param x,y,weight  functions of a point
template <typename Points, typename X, typename Y, typename Weight>
[[nodiscard]] FittedLine fit_line(const Points& points, X x, Y y, Weight weight) {
  FittedLine line;
  for (const auto& each : points) line.count += weight(each);
  for (const auto& each : points) {
    line.mean_x += weight(each) * x(each) / line.count;
    line.mean_y += weight(each) * y(each) / line.count;
  }
  for (const auto& each : points) {
    const double dx = x(each) - line.mean_x;
    const double dy = y(each) - line.mean_y;
    line.xx += weight(each) * dx * dx;
    line.xy += weight(each) * dx * dy;
    line.yy += weight(each) * dy * dy;
  }
  return line;
}

template <typename Points, typename X, typename Y>
[[nodiscard]] FittedLine fit_line(const Points& points, X x, Y y) {
  return fit_line(points, x, y, [](const auto&) { return 1.0; });
}

/// \param pairs  x and y
template <typename Pairs>
[[nodiscard]] FittedLine fit_line(const Pairs& pairs) {
  return fit_line(
      pairs, [](const auto& pair) { return pair.first; },
      [](const auto& pair) { return pair.second; });
}

}  // namespace merkel
