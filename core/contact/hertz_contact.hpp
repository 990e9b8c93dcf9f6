#pragma once

#include "core/realtime_tag.hpp"
#include "core/records/contact_state.hpp"

namespace merkel {

/// Hertz contact of a rigid sphere with elastic skin.
///
/// 1/R* = 1/R + 1/R_skin; a = √(R*·d), F = 4/3·E*·√R*·d^1.5, p0 = 2E*a/(πR*)   (Eq. 1, corrected)
/// Johnson, Contact Mechanics (1985), ch. 4. Real-time: yes.
class HertzContact {
 public:
  /// Radii in mm, > 0. Infinity is a flat plate or flat skin; at most one of the two is infinite.
  HertzContact(double sphere_radius_mm, double skin_radius_mm, double reduced_modulus_kPa) noexcept;

  /// The contact at an indentation depth. A depth ≤ 0 means no contact.
  [[nodiscard]] ContactState at_depth(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The contact under a force, d = (3F/(4E*√R*))^(2/3). A force ≤ 0 means no contact.
  [[nodiscard]] ContactState at_force(double force_mN) const noexcept MERKEL_REALTIME;

  /// p(r) = p0·√(1−r²/a²) inside the contact, 0 outside.
  [[nodiscard]] static double pressure_kPa(const ContactState& contact,
                                           double r_mm) noexcept MERKEL_REALTIME;

  /// Downward displacement U(r) of the skin's surface (Eq. 2, corrected) from the depth and radius
  /// of the contact, with p0/E* = 2d/(πa):
  /// r < a: d·(1 − r²/2a²); else d/(πa²)·[(2a²−r²)·asin(a/r) + r·a·√(1−a²/r²)].
  /// Far away the terms in brackets cancel, so beyond 20 a the series in q = a/r is used:
  /// 4d/(3π)·q·(1 + q²/10 + 9q⁴/280 + 5q⁶/336 + 35q⁸/4224), exact to 1e-15 there.
  [[nodiscard]] static double surface_displacement_mm(const ContactState& contact,
                                                      double r_mm) noexcept MERKEL_REALTIME;

  /// The radius within which the surface is displaced by at least `displacement_mm`; 0 if there is
  /// none. U falls with r, so the displaced area is a disc. Bisection to 1 nm.
  [[nodiscard]] static double radius_of_displacement_mm(
      const ContactState& contact, double displacement_mm) noexcept MERKEL_REALTIME;

 private:
  double effective_radius_mm_;
  double reduced_modulus_kPa_;
};

}  // namespace merkel
