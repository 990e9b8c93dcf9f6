#include "tools/studies/reference/flat_tip_boundary_elements.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

namespace merkel::reference {
namespace {

using std::numbers::pi;

/// Displacement at (x, y) from the centre of a rectangle with half sides a and b under unit
/// pressure, times πE*.
double love(double x, double y, double a, double b) {
  const auto term = [](double s, double t) { return t + std::hypot(s, t); };
  return (x + a) * std::log(term(x + a, y + b) / term(x + a, y - b)) +
         (y + b) * std::log(term(y + b, x + a) / term(y + b, x - a)) +
         (x - a) * std::log(term(x - a, y - b) / term(x - a, y + b)) +
         (y - b) * std::log(term(y - b, x - a) / term(y - b, x + a));
}

}  // namespace

FlatTipBoundaryElements::FlatTipBoundaryElements(const Parameters& p)
    : poisson_ratio_(p.poisson_ratio) {
  // Quarter of the contact; along y, at most to the edge of the undeformed skin below the bar.
  const double half_width = 0.5 * p.width_mm;
  const double reach = std::min(0.5 * p.length_mm, std::sqrt(2.0 * p.skin_radius_mm * p.depth_mm));
  const auto edges = [](double end, int count, bool crowded) {
    std::vector<double> lines;
    for (int k = 0; k <= count; ++k) {
      const double s = static_cast<double>(k) / count;
      lines.push_back(end * (crowded ? std::sin(0.5 * pi * s) : s));
    }
    return lines;
  };
  const auto x_lines = edges(half_width, p.columns / 2, !p.round);
  const auto y_lines = edges(reach, p.rows / 2, !p.round && 2.0 * reach >= p.length_mm);
  for (std::size_t j = 0; j + 1 < y_lines.size(); ++j) {
    for (std::size_t i = 0; i + 1 < x_lines.size(); ++i) {
      const double x = 0.5 * (x_lines[i] + x_lines[i + 1]);
      const double y = 0.5 * (y_lines[j] + y_lines[j + 1]);
      if (p.round && std::hypot(x, y) > half_width) continue;
      elements_.push_back({.x = x,
                           .y = y,
                           .half_width = 0.5 * (x_lines[i + 1] - x_lines[i]),
                           .half_length = 0.5 * (y_lines[j + 1] - y_lines[j]),
                           .pressure_kPa = 0.0});
    }
  }
  const auto count = static_cast<Eigen::Index>(elements_.size());
  Eigen::MatrixXd influence(count, count);
  Eigen::VectorXd wanted(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Element& at = elements_[static_cast<std::size_t>(i)];
    wanted(i) = p.depth_mm - at.y * at.y / (2.0 * p.skin_radius_mm) -
                at.x * at.x / (2.0 * p.skin_radius_along_mm);
    for (Eigen::Index j = 0; j < count; ++j) {
      const Element& of = elements_[static_cast<std::size_t>(j)];
      double sum = 0.0;
      for (const double sx : {-1.0, 1.0}) {
        for (const double sy : {-1.0, 1.0}) {
          sum += love(at.x - sx * of.x, at.y - sy * of.y, of.half_width, of.half_length);
        }
      }
      influence(i, j) = sum / (pi * p.reduced_modulus_kPa);
    }
  }
  std::vector<Eigen::Index> active(static_cast<std::size_t>(count));
  for (Eigen::Index i = 0; i < count; ++i) active[static_cast<std::size_t>(i)] = i;
  for (int pass = 0; pass < 60; ++pass) {
    const Eigen::VectorXd pressure = influence(active, active).partialPivLu().solve(wanted(active));
    std::vector<Eigen::Index> kept;
    for (std::size_t k = 0; k < active.size(); ++k) {
      if (pressure(static_cast<Eigen::Index>(k)) > 0.0) kept.push_back(active[k]);
    }
    if (kept.size() < active.size()) {
      active = std::move(kept);
      continue;
    }
    for (std::size_t k = 0; k < active.size(); ++k) {
      Element& element = elements_[static_cast<std::size_t>(active[k])];
      element.pressure_kPa = pressure(static_cast<Eigen::Index>(k));
      force_mN_ += 16.0 * element.pressure_kPa * element.half_width * element.half_length;
    }
    break;
  }
}

CartesianStress FlatTipBoundaryElements::stress(double x_mm, double y_mm, double z_mm) const {
  CartesianStress sum;
  for (const Element& element : elements_) {
    if (!(element.pressure_kPa > 0.0)) continue;
    const double load = 4.0 * element.pressure_kPa * element.half_width * element.half_length;
    for (const double sx : {-1.0, 1.0}) {
      for (const double sy : {-1.0, 1.0}) {
        const double dx = x_mm - sx * element.x;
        const double dy = y_mm - sy * element.y;
        const double r2 = dx * dx + dy * dy;
        const double rho = std::sqrt(r2 + z_mm * z_mm);
        const double rho5 = rho * rho * rho * rho * rho;
        const double scale = load / (2.0 * pi);
        const double side = (1.0 - 2.0 * poisson_ratio_);
        const double lateral = side / (rho * (rho + z_mm));
        const AxisymmetricStress polar{
            .sigma_r = scale * (lateral - 3.0 * z_mm * r2 / rho5),
            .sigma_theta = -scale * (lateral - side * z_mm / (rho * rho * rho)),
            .sigma_z = -scale * 3.0 * z_mm * z_mm * z_mm / rho5,
            .tau_rz = -scale * 3.0 * std::sqrt(r2) * z_mm * z_mm / rho5};
        sum += cartesian(polar, dx, dy);
      }
    }
  }
  return sum;
}

}  // namespace merkel::reference
