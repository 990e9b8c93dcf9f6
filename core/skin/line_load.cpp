#include "core/skin/line_load.hpp"

#include <cassert>
#include <cmath>
#include <numbers>

namespace merkel {
namespace {

/// The antiderivative along the line, at the distance s from one end.
CartesianStress up_to(double s, double X, double z, double nu) noexcept {
  const double q2 = X * X + z * z;
  const double R = std::sqrt(q2 + s * s);
  const double R3 = R * R * R;
  const double fifth = s * (2.0 * s * s + 3.0 * q2) / (3.0 * q2 * q2 * R3);
  const double lateral = (1.0 - 2.0 * nu) / (R * (R + z));
  return {.sigma_x = -3.0 * z * X * X * fifth + lateral * s,
          .sigma_y = -z * s * s * s / (q2 * R3) + (1.0 - 2.0 * nu) * z * s / (q2 * R) - lateral * s,
          .sigma_z = -3.0 * z * z * z * fifth,
          .tau_xy = z * X / R3 - lateral * X,
          .tau_yz = z * z / R3,
          .tau_zx = -3.0 * X * z * z * fifth};
}

}  // namespace

CartesianStress line_load_stress(const LineLoad& load, double poisson_ratio, double x_mm,
                                 double y_mm, double z_mm) noexcept {
  assert(z_mm > 0.0);
  const double X = x_mm - load.x_mm;
  const double scale = load.force_per_length_mN_per_mm / (2.0 * std::numbers::pi);
  const CartesianStress near = up_to(y_mm + load.half_length_mm, X, z_mm, poisson_ratio);
  const CartesianStress far = up_to(y_mm - load.half_length_mm, X, z_mm, poisson_ratio);
  return {.sigma_x = scale * (near.sigma_x - far.sigma_x),
          .sigma_y = scale * (near.sigma_y - far.sigma_y),
          .sigma_z = scale * (near.sigma_z - far.sigma_z),
          .tau_xy = scale * (near.tau_xy - far.tau_xy),
          .tau_yz = scale * (near.tau_yz - far.tau_yz),
          .tau_zx = scale * (near.tau_zx - far.tau_zx)};
}

double line_load_displacement_mm(const LineLoad& load, double reduced_modulus_kPa, double x_mm,
                                 double y_mm) noexcept {
  const double X = std::fabs(x_mm - load.x_mm);
  return load.force_per_length_mN_per_mm / (std::numbers::pi * reduced_modulus_kPa) *
         (std::asinh((load.half_length_mm + y_mm) / X) +
          std::asinh((load.half_length_mm - y_mm) / X));
}

}  // namespace merkel
