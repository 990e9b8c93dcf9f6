#pragma once

#include <cmath>

namespace merkel {

/// Stress on the axes r, θ, z of an axisymmetric load; tension positive, z into the skin. kPa.
struct AxisymmetricStress {
  double sigma_r = 0.0;
  double sigma_theta = 0.0;
  double sigma_z = 0.0;
  double tau_rz = 0.0;
};

/// Stress on the patch's axes, the sum of all loads, kPa.
struct CartesianStress {
  double sigma_x = 0.0;
  double sigma_y = 0.0;
  double sigma_z = 0.0;
  double tau_xy = 0.0;
  double tau_yz = 0.0;
  double tau_zx = 0.0;

  CartesianStress& operator+=(const CartesianStress& other) noexcept {
    sigma_x += other.sigma_x;
    sigma_y += other.sigma_y;
    sigma_z += other.sigma_z;
    tau_xy += other.tau_xy;
    tau_yz += other.tau_yz;
    tau_zx += other.tau_zx;
    return *this;
  }
  friend CartesianStress operator*(const CartesianStress& stress, double factor) noexcept {
    return {.sigma_x = stress.sigma_x * factor,
            .sigma_y = stress.sigma_y * factor,
            .sigma_z = stress.sigma_z * factor,
            .tau_xy = stress.tau_xy * factor,
            .tau_yz = stress.tau_yz * factor,
            .tau_zx = stress.tau_zx * factor};
  }
};

/// Converts an axisymmetric stress at (dx, dy) from its axis to the patch's axes. On the axis, the
/// direction is arbitrary. Real-time: yes.
[[nodiscard]] inline CartesianStress cartesian(const AxisymmetricStress& stress, double dx_mm,
                                               double dy_mm) noexcept {
  const double r2 = dx_mm * dx_mm + dy_mm * dy_mm;
  const double xx = r2 > 0.0 ? dx_mm * dx_mm / r2 : 1.0;
  const double yy = 1.0 - xx;
  const double xy = r2 > 0.0 ? dx_mm * dy_mm / r2 : 0.0;
  const double r = std::sqrt(r2);
  const double x = r > 0.0 ? dx_mm / r : 1.0;
  const double y = r > 0.0 ? dy_mm / r : 0.0;
  return {.sigma_x = stress.sigma_r * xx + stress.sigma_theta * yy,
          .sigma_y = stress.sigma_r * yy + stress.sigma_theta * xx,
          .sigma_z = stress.sigma_z,
          .tau_xy = (stress.sigma_r - stress.sigma_theta) * xy,
          .tau_yz = stress.tau_rz * y,
          .tau_zx = stress.tau_rz * x};
}

}  // namespace merkel
