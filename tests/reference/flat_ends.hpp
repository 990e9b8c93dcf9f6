#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "core/skin/stress.hpp"

// Rigid flat ends of any shape on an elastic half-space, by boundary elements that crowd at the
// rims; none of the project's code is used. The elements of rectangles carry uniform pressures
// (Love 1929), those of rings too: 1/r around a circle is 4K(k)/(r + s), k² = 4rs/(r + s)².

namespace merkel::reference {

/// A pressed flat end: forces at points, and their sum.
struct FlatEnds {
  struct Load {
    double x_mm, y_mm, force_mN;
  };
  std::vector<Load> loads;
  double force_mN = 0.0;

  [[nodiscard]] CartesianStress stress(double x_mm, double y_mm, double z_mm,
                                       double poisson_ratio) const {
    CartesianStress sum;
    for (const Load& load : loads) {
      const double dx = x_mm - load.x_mm;
      const double dy = y_mm - load.y_mm;
      const double r2 = dx * dx + dy * dy;
      const double rho = std::sqrt(r2 + z_mm * z_mm);
      const double rho5 = std::pow(rho, 5.0);
      const double scale = load.force_mN / (2.0 * std::numbers::pi);
      const double side = 1.0 - 2.0 * poisson_ratio;
      const double lateral = side / (rho * (rho + z_mm));
      const AxisymmetricStress polar{
          .sigma_r = scale * (lateral - 3.0 * z_mm * r2 / rho5),
          .sigma_theta = -scale * (lateral - side * z_mm / (rho * rho * rho)),
          .sigma_z = -scale * 3.0 * z_mm * z_mm * z_mm / rho5,
          .tau_rz = -scale * 3.0 * std::sqrt(r2) * z_mm * z_mm / rho5};
      sum += cartesian(polar, dx, dy);
    }
    return sum;
  }
};

struct EndRectangle {
  double x_mm, y_mm, width_mm, length_mm;
};

/// Edges of elements between two ends, crowded at both.
inline std::vector<double> crowded(double first, double last, int count) {
  std::vector<double> edges;
  for (int k = 0; k <= count; ++k) {
    const double s = std::sin(0.5 * std::numbers::pi * (2.0 * k / count - 1.0));
    edges.push_back(0.5 * (first + last) + 0.5 * (last - first) * s);
  }
  return edges;
}

/// \param across  elements over the smaller side of a rectangle
inline FlatEnds pressed_rectangles(const std::vector<EndRectangle>& ends, double depth_mm,
                                   double modulus_kPa, int across) {
  struct Element {
    double x, y, a, b;
  };
  std::vector<Element> elements;
  for (const EndRectangle& end : ends) {
    const double small = std::min(end.width_mm, end.length_mm);
    const auto count = [&](double side) {
      return static_cast<int>(std::lround(across * std::sqrt(side / small)));
    };
    const auto x =
        crowded(end.x_mm - 0.5 * end.width_mm, end.x_mm + 0.5 * end.width_mm, count(end.width_mm));
    const auto y = crowded(end.y_mm - 0.5 * end.length_mm, end.y_mm + 0.5 * end.length_mm,
                           count(end.length_mm));
    for (std::size_t j = 0; j + 1 < y.size(); ++j) {
      for (std::size_t i = 0; i + 1 < x.size(); ++i) {
        elements.push_back({0.5 * (x[i] + x[i + 1]), 0.5 * (y[j] + y[j + 1]),
                            0.5 * (x[i + 1] - x[i]), 0.5 * (y[j + 1] - y[j])});
      }
    }
  }
  const auto love = [](double x, double y, double a, double b) {
    const auto part = [](double s, double t) {
      return s == 0.0 ? 0.0 : s * std::asinh(t / std::fabs(s));
    };
    const auto corner = [&](double s, double t) { return part(s, t) + part(t, s); };
    return corner(x + a, y + b) - corner(x - a, y + b) - corner(x + a, y - b) +
           corner(x - a, y - b);
  };
  const auto n = static_cast<Eigen::Index>(elements.size());
  Eigen::MatrixXd influence(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Element& at = elements[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j) {
      const Element& of = elements[static_cast<std::size_t>(j)];
      influence(i, j) =
          love(at.x - of.x, at.y - of.y, of.a, of.b) / (std::numbers::pi * modulus_kPa);
    }
  }
  const Eigen::VectorXd pressure =
      influence.partialPivLu().solve(Eigen::VectorXd::Constant(n, depth_mm));
  FlatEnds pressed;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Element& at = elements[static_cast<std::size_t>(i)];
    pressed.loads.push_back({at.x, at.y, 4.0 * at.a * at.b * pressure(i)});
    pressed.force_mN += pressed.loads.back().force_mN;
  }
  return pressed;
}

/// K(k), by the arithmetic-geometric mean. \param complement  √(1 − k²)
inline double complete_elliptic(double complement) {
  double a = 1.0;
  double g = complement;
  for (int k = 0; k < 40 && a - g > 1e-15 * a; ++k) {
    const double mean = 0.5 * (a + g);
    g = std::sqrt(a * g);
    a = mean;
  }
  return 0.5 * std::numbers::pi / a;
}

/// A flat ring; of inner radius 0, a coin.
inline FlatEnds pressed_ring(double inner_mm, double outer_mm, double depth_mm, double modulus_kPa,
                             int rings) {
  constexpr int kAngles = 240;
  const auto edges = crowded(inner_mm, outer_mm, rings);
  const auto n = static_cast<Eigen::Index>(rings);
  const auto middle = [&](Eigen::Index i) {
    return 0.5 * (edges[static_cast<std::size_t>(i)] + edges[static_cast<std::size_t>(i) + 1]);
  };
  // ∫ s/(r + s)·4K ds from r outwards or inwards; s = r + (end − r)t² removes the logarithm.
  const auto from = [](double r, double end) {
    constexpr int kPoints = 200;
    double sum = 0.0;
    for (int k = 0; k < kPoints; ++k) {
      const double t = (k + 0.5) / kPoints;
      const double s = r + (end - r) * t * t;
      sum += 2.0 * t * std::fabs(end - r) / kPoints * 4.0 * s / (r + s) *
             complete_elliptic(std::fabs(r - s) / (r + s));
    }
    return sum;
  };
  Eigen::MatrixXd influence(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double inner = edges[static_cast<std::size_t>(j)];
      const double outer = edges[static_cast<std::size_t>(j) + 1];
      const double r = middle(i);
      double sum = 0.0;
      if (i == j) {
        sum = from(r, outer) + from(r, inner);
      } else {
        constexpr int kPoints = 40;
        for (int k = 0; k < kPoints; ++k) {
          const double s = inner + (outer - inner) * (k + 0.5) / kPoints;
          sum += (outer - inner) / kPoints * 4.0 * s / (r + s) *
                 complete_elliptic(std::fabs(r - s) / (r + s));
        }
      }
      influence(i, j) = sum / (std::numbers::pi * modulus_kPa);
    }
  }
  const Eigen::VectorXd pressure =
      influence.partialPivLu().solve(Eigen::VectorXd::Constant(n, depth_mm));
  FlatEnds pressed;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double inner = edges[static_cast<std::size_t>(i)];
    const double outer = edges[static_cast<std::size_t>(i) + 1];
    const double force = std::numbers::pi * (outer * outer - inner * inner) * pressure(i);
    pressed.force_mN += force;
    for (int k = 0; k < kAngles; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / kAngles;
      pressed.loads.push_back(
          {middle(i) * std::cos(angle), middle(i) * std::sin(angle), force / kAngles});
    }
  }
  return pressed;
}

}  // namespace merkel::reference
