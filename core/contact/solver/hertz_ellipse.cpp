#include "core/contact/solver/hertz_ellipse.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/bisection.hpp"

namespace merkel {
namespace {

using std::numbers::pi;

/// The complete elliptic integrals of modulus e = √(1−q²), by the arithmetic-geometric mean:
/// K, and S = 1 − E/K without cancellation.
struct Elliptic {
  double K, S;
  explicit Elliptic(double q) noexcept : K(0.0), S(0.5 * (1.0 - q) * (1.0 + q)) {
    double a = 1.0;
    double g = q;
    for (double weight = 1.0; weight < 256.0; weight *= 2.0) {
      const double half = 0.5 * (a - g);
      const double mean = 0.5 * (a + g);
      S += weight * half * half;
      g = std::sqrt(a * g);
      a = mean;
    }
    K = pi / (2.0 * a);
  }
};

/// ∫√(c² − t²) dt from 0 to t.
double half_disc(double c, double t) {
  if (!(c > 0.0)) return 0.0;
  const double s = std::clamp(t / c, -1.0, 1.0);
  return 0.5 * c * c * (s * std::sqrt((1.0 - s) * (1.0 + s)) + std::asin(s));
}

/// The integral of √(1 − x² − y²) over a rectangle.
double ellipsoid_over(double x0, double x1, double y0, double y1) {
  constexpr int kStrips = 8;
  const double left = std::max(x0, -1.0);
  const double width = (std::min(x1, 1.0) - left) / kStrips;
  if (!(width > 0.0)) return 0.0;
  double sum = 0.0;
  for (int k = 0; k < kStrips; ++k) {
    const double x = left + (k + 0.5) * width;
    const double c = std::sqrt(std::max(0.0, (1.0 - x) * (1.0 + x)));
    sum += half_disc(c, y1) - half_disc(c, y0);
  }
  return sum * width;
}

}  // namespace

HertzEllipse::HertzEllipse(double curvature_x, double curvature_y, double modulus_kPa) noexcept {
  const double A = 0.5 * std::min(curvature_x, curvature_y);
  const double B = 0.5 * std::max(curvature_x, curvature_y);
  // The ratio of the curvatures falls as q = b/a rises to 1.
  const double q = bisected(0.0, 1.0, [&](double part) {
    const double m = (1.0 - part) * (1.0 + part);
    const double S = Elliptic(part).S;
    return !(m > 1e-14) ? false : (m - S) > B / A * part * part * S;
  });
  const double m = (1.0 - q) * (1.0 + q);
  const Elliptic at(q);
  const double a = std::sqrt((m > 1e-12 ? at.S / m : 0.5) / A);
  const double b = q * a;
  half_x_ = curvature_x <= curvature_y ? a : b;
  half_y_ = curvature_x <= curvature_y ? b : a;
  peak_pressure_ = modulus_kPa / (at.K * b);
  force_ = 2.0 / 3.0 * pi * a * modulus_kPa / at.K;
}

void HertzEllipse::fill(double depth_mm, const PixelGrid& grid, std::span<double> pressure) const {
  const double root = std::sqrt(depth_mm);
  const double half = 0.5 * grid.pixel_mm;
  const double to_x = 1.0 / (half_x_ * root);
  const double to_y = 1.0 / (half_y_ * root);
  double total = 0.0;
  for (std::size_t row = 0; row < grid.rows; ++row) {
    const double y = grid.y_mm(row);
    for (std::size_t column = 0; column < grid.columns; ++column) {
      const double x = grid.x_mm(column);
      double& sum = pressure[row * grid.columns + column];
      sum = ellipsoid_over((x - half) * to_x, (x + half) * to_x, (y - half) * to_y,
                           (y + half) * to_y);
      total += sum;
    }
  }
  const double scale = force_ * depth_mm * root / (total * grid.pixel_mm * grid.pixel_mm);
  for (double& p : pressure) p *= scale;
}

}  // namespace merkel
