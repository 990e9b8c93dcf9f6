#pragma once

namespace merkel::reference {

/// Contact of an exact rigid sphere with an elastic half-space. Hertz approximates the sphere by a
/// paraboloid, which is inaccurate where a/R is large.
///
/// d = a/2·ln((R+a)/(R−a)), F = E*·[(R²+a²)/2·ln((R+a)/(R−a)) − aR]
/// Sneddon, Int. J. Engng Sci. 3 (1965) 47. The pressure is approximated by the semi-ellipse
/// p0·√(1−r²/a²) of the same force and radius.
class SneddonContact {
 public:
  struct Contact {
    double depth_mm = 0.0;
    double force_mN = 0.0;
    double contact_radius_mm = 0.0;
    double peak_pressure_kPa = 0.0;
  };
  /// \param radius_mm  R > 0, finite
  SneddonContact(double radius_mm, double reduced_modulus_kPa) noexcept;

  /// The contact at an indentation depth. A depth ≤ 0 means no contact.
  [[nodiscard]] Contact at_depth(double depth_mm) const noexcept;
  /// The contact under a force. A force ≤ 0 means no contact.
  [[nodiscard]] Contact at_force(double force_mN) const noexcept;

 private:
  [[nodiscard]] Contact at_radius_ratio(double q) const noexcept;

  double radius_mm_;
  double reduced_modulus_kPa_;
};

}  // namespace merkel::reference
