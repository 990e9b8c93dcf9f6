#include "core/math/gauss_legendre.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace merkel {

std::vector<QuadratureNode> gauss_legendre(int points, double low, double high) {
  std::vector<QuadratureNode> nodes(static_cast<std::size_t>(points));
  const double half = 0.5 * (high - low);
  for (int k = 0; k < points; ++k) {
    // Newton's iteration on the Legendre polynomial, from the usual initial guess.
    double x = std::cos(std::numbers::pi * (k + 0.75) / (points + 0.5));
    double slope = 0.0;
    for (int iteration = 0; iteration < 10; ++iteration) {
      double value = 1.0;
      double before = 0.0;
      for (int n = 1; n <= points; ++n) {
        const double next = ((2 * n - 1) * x * value - (n - 1) * before) / n;
        before = value;
        value = next;
      }
      slope = points * (x * value - before) / (x * x - 1.0);
      x -= value / slope;
    }
    nodes[static_cast<std::size_t>(points - 1 - k)] = {
        .x = low + half * (1.0 + x), .weight = 2.0 * half / ((1.0 - x * x) * slope * slope)};
  }
  return nodes;
}

}  // namespace merkel
