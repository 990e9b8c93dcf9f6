#pragma once

#include <span>

#include "core/contact/solver/pixel_kernels.hpp"

namespace merkel {

/// Frictionless Hertz contact with a gap x²·kx/2 + y²·ky/2 on an elastic half-space. The pressure
/// p0·√(1 − x²/a² − y²/b²) lies on an ellipse of fixed shape that grows with the root of the depth.
///
/// With e² = 1 − (b/a)², a ≥ b, and A ≤ B half of the two curvatures,
/// B/A = (E(e)/(1−e²) − K(e))/(K(e) − E(e)); a²e²A = d·(K − E)/K; p0 = d·E*/(K·b);
/// F = ⅔π·a·b·p0. Johnson, Contact Mechanics (1985), ch. 4.2.
class HertzEllipse {
 public:
  /// \param curvature_x_per_mm  kx and ky, of tip and skin together, > 0
  HertzEllipse(double curvature_x_per_mm, double curvature_y_per_mm,
               double reduced_modulus_kPa) noexcept;

  /// Half of the contact along x and y, per root of the depth in mm.
  [[nodiscard]] double half_x() const noexcept { return half_x_; }
  [[nodiscard]] double half_y() const noexcept { return half_y_; }
  /// The force of a depth of 1 mm, mN; it grows with d^1.5.
  [[nodiscard]] double force() const noexcept { return force_; }
  /// The pressure in the middle at a depth of 1 mm, kPa; it grows with √d.
  [[nodiscard]] double peak_pressure() const noexcept { return peak_pressure_; }

  /// The mean pressures of pixels around the contact's middle. Real-time: no.
  void fill(double depth_mm, const PixelGrid& grid, std::span<double> pressure_kPa) const;

 private:
  double half_x_;
  double half_y_;
  double force_;
  double peak_pressure_;
};

}  // namespace merkel
