#include "core/contact/sphere_law.hpp"

#include <cmath>
#include <numbers>

#include "core/math/bisection.hpp"

namespace merkel {

SphereLaw::SphereLaw(const SkinParameters& skin, double radius_mm)
    : hertz_(radius_mm, skin.radius_mm, SkinMaterial(skin).reduced_modulus_kPa()), skin_(skin) {
  if (skin.round()) return;
  ellipse_.emplace(1.0 / radius_mm + 1.0 / skin.finger_along_mm(),
                   1.0 / radius_mm + 1.0 / skin.radius_mm,
                   SkinMaterial(skin).reduced_modulus_kPa());
}

ContactState SphereLaw::elastic_at_depth(double depth_mm) const noexcept {
  if (!ellipse_) return hertz_.at_depth(depth_mm);
  if (!(depth_mm > 0.0)) return {};
  const double root = std::sqrt(depth_mm);
  return {.depth_mm = depth_mm,
          .force_mN = ellipse_->force() * depth_mm * root,
          .contact_radius_mm = std::sqrt(ellipse_->half_x() * ellipse_->half_y()) * root,
          .peak_pressure_kPa = ellipse_->peak_pressure() * root};
}

ContactState SphereLaw::at_depth(double depth_mm) const noexcept {
  ContactState contact = elastic_at_depth(depth_mm);
  if (!skin_.stiffens() || !contact.touching()) return contact;
  const double area_mm2 = std::numbers::pi * contact.contact_radius_mm * contact.contact_radius_mm;
  contact.stiffening = skin_.stiffening_at(contact.depth_mm, contact.force_mN / area_mm2);
  contact.force_mN *= contact.stiffening;
  contact.peak_pressure_kPa *= contact.stiffening;
  return contact;
}

ContactState SphereLaw::at_force(double force_mN) const noexcept {
  if (!ellipse_ && !skin_.stiffens()) return hertz_.at_force(force_mN);
  if (!(force_mN > 0.0)) return {};
  const double root = ellipse_ ? std::cbrt(force_mN / ellipse_->force()) : 0.0;
  double depth = ellipse_ ? root * root : hertz_.at_force(force_mN).depth_mm;
  if (skin_.stiffens()) {
    // The skin can only be stiffer than at rest; the force rises with the depth.
    depth = bisected(0.0, depth, [&](double d) { return at_depth(d).force_mN < force_mN; });
  }
  ContactState contact = at_depth(depth);
  contact.force_mN = force_mN;
  return contact;
}

}  // namespace merkel
