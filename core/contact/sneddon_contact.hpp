#pragma once

#include "core/contact/contact_state.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// Contact of an exact rigid sphere with an elastic half-space. Hertz approximates the sphere by a
/// paraboloid, which is inaccurate where a/R is large.
///
/// d = a/2·ln((R+a)/(R−a)), F = E*·[(R²+a²)/2·ln((R+a)/(R−a)) − aR]
/// Sneddon, Int. J. Engng Sci. 3 (1965) 47. The pressure is approximated by the semi-ellipse
/// p0·√(1−r²/a²) of the same force and radius. Real-time: yes (a bisection of bounded length).
class SneddonContact {
 public:
  /// \param radius_mm  R > 0, finite
  SneddonContact(double radius_mm, double reduced_modulus_kPa) noexcept;

  /// The contact at an indentation depth. A depth ≤ 0 means no contact.
  [[nodiscard]] ContactState at_depth(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The contact under a force. A force ≤ 0 means no contact.
  [[nodiscard]] ContactState at_force(double force_mN) const noexcept MERKEL_REALTIME;

 private:
  [[nodiscard]] ContactState at_radius_ratio(double q) const noexcept;

  double radius_mm_;
  double reduced_modulus_kPa_;
};

}  // namespace merkel
