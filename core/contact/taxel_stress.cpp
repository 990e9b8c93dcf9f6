#include "core/contact/taxel_stress.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/gauss_legendre.hpp"
#include "core/skin/point_load.hpp"

namespace merkel {
namespace {

constexpr double kPointDisc_mm = 0.05;
constexpr int kMaxTerms = 40;

/// Gauss-Legendre nodes over a length, for an error of some 1e-6: the stress is analytic up to a
/// distance of the depth from it, so the error falls by e^(−2·asinh(2z/size)) per node.
int nodes_over(double size_mm, double depth_mm) {
  return std::clamp(static_cast<int>(std::ceil(8.0 / std::asinh(2.0 * depth_mm / size_mm))), 3, 64);
}

}  // namespace

TaxelStress::TaxelStress(const TaxelArray& array, const SkinParameters& skin, double farthest_mm)
    : poisson_ratio_(SkinMaterial(skin).poisson_ratio()), depth_mm_(skin.receptor_depth_mm) {
  const LayeredMedium medium(skin);
  if (!medium.half_space()) {
    layered_ = std::make_unique<PointResponse>(medium, depth_mm_, kPointDisc_mm,
                                               farthest_mm + array.width_mm + array.length_mm);
  }
  const double half = 0.5 * array.width_mm;
  if (array.shape == TaxelArray::Shape::kDisc) {
    const int points = nodes_over(half, depth_mm_);
    const int angles = 4 * points;
    for (const auto& [r, weight] : gauss_legendre(points, 0.0, half)) {
      for (int k = 0; k < angles; ++k) {
        const double angle = 2.0 * std::numbers::pi * (k + 0.5) / angles;
        loads_.push_back({r * std::cos(angle), r * std::sin(angle),
                          weight * r * 2.0 * std::numbers::pi / angles});
      }
    }
    return;
  }
  const double half_length = 0.5 * array.length_mm;
  const auto along_y =
      gauss_legendre(nodes_over(array.length_mm, depth_mm_), -half_length, half_length);
  for (const auto& [x, weight_x] :
       gauss_legendre(nodes_over(array.width_mm, depth_mm_), -half, half)) {
    for (const auto& [y, weight_y] : along_y) loads_.push_back({x, y, weight_x * weight_y});
  }
}

TaxelStress::Components TaxelStress::at(double x_mm, double y_mm) const {
  CartesianStress sum;
  for (const Load& load : loads_) {
    const double x = x_mm - load.x_mm;
    const double y = y_mm - load.y_mm;
    const double r = std::hypot(x, y);
    sum += layered_
               ? cartesian(layered_->stress(r), x, y) * load.force_mN
               : cartesian(point_load_stress(load.force_mN, poisson_ratio_, r, depth_mm_), x, y);
  }
  return {sum.sigma_x, sum.sigma_y, sum.sigma_z, sum.tau_xy, sum.tau_yz, sum.tau_zx};
}

SeparableStress::SeparableStress(const TaxelStress& stress, std::size_t component,
                                 const std::vector<double>& x_mm, const std::vector<double>& y_mm,
                                 double error_kPa)
    : stress_(stress), component_(component) {
  std::vector<double> rest;
  for (const double x : x_mm) {
    for (const double y : y_mm) rest.push_back(stress.at(x, y)[component]);
  }
  const std::size_t columns = y_mm.size();
  while (terms() < kMaxTerms) {
    const auto largest = std::max_element(
        rest.begin(), rest.end(), [](double a, double b) { return std::fabs(a) < std::fabs(b); });
    if (std::fabs(*largest) <= error_kPa) return;
    const auto place = static_cast<std::size_t>(largest - rest.begin());
    Pivot pivot{.x_mm = x_mm[place / columns],
                .y_mm = y_mm[place % columns],
                .value = *largest,
                .x = {},
                .y = {}};
    pivot.x = along_x(pivot.x_mm);
    pivot.y = along_y(pivot.y_mm);
    pivots_.push_back(std::move(pivot));
    std::vector<double> v;
    for (const double y : y_mm) v.push_back(along_y(y).back());
    for (std::size_t i = 0; i < x_mm.size(); ++i) {
      const double u = along_x(x_mm[i]).back();
      for (std::size_t j = 0; j < columns; ++j) rest[i * columns + j] -= u * v[j];
    }
  }
}

std::vector<double> SeparableStress::along_x(double x_mm) const {
  std::vector<double> u;
  for (const Pivot& pivot : pivots_) {
    double value = stress_.at(x_mm, pivot.y_mm)[component_];
    for (std::size_t s = 0; s < u.size(); ++s) value -= u[s] * pivot.y[s];
    u.push_back(value);
  }
  return u;
}

std::vector<double> SeparableStress::along_y(double y_mm) const {
  std::vector<double> v;
  for (const Pivot& pivot : pivots_) {
    double value = stress_.at(pivot.x_mm, y_mm)[component_];
    for (std::size_t s = 0; s < v.size(); ++s) value -= pivot.x[s] * v[s];
    v.push_back(value / pivot.value);
  }
  return v;
}

}  // namespace merkel
