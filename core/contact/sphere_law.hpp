#pragma once

#include <optional>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/solver/hertz_ellipse.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_state.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// Hertz contact of a sphere with a half-space of one material: circular, or elliptic on a finger
/// with two radii, where the contact radius is that of the circle of the same area. The skin may
/// stiffen. Real-time: yes, after construction.
class SphereLaw {
 public:
  /// \param radius_mm  of the sphere; infinity is a flat plate, on curved skin only
  SphereLaw(const SkinParameters& skin, double radius_mm);

  /// The contact at an indentation depth. A depth ≤ 0 means no contact.
  [[nodiscard]] ContactState at_depth(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The contact under a force. A force ≤ 0 means no contact.
  [[nodiscard]] ContactState at_force(double force_mN) const noexcept MERKEL_REALTIME;

  /// The elliptic contact; empty: it is circular.
  [[nodiscard]] const std::optional<HertzEllipse>& ellipse() const noexcept { return ellipse_; }

 private:
  /// The contact with the moduli of undeformed skin.
  [[nodiscard]] ContactState elastic_at_depth(double depth_mm) const noexcept;

  HertzContact hertz_;  ///< across the finger
  std::optional<HertzEllipse> ellipse_;
  SkinParameters skin_;
};

}  // namespace merkel
