#include "core/contact/sphere_law.hpp"

#include <cmath>
#include <numbers>

#include "core/math/bisection.hpp"

namespace merkel {

SphereLaw::SphereLaw(const SkinParameters& skin, double radius_mm)
    : hertz_(radius_mm, skin.radius_mm, SkinMaterial(skin).reduced_modulus_kPa()), skin_(skin) {
  if (skin.contact_law == ContactLaw::kSneddon) {
    sneddon_.emplace(hertz_.effective_radius_mm(), SkinMaterial(skin).reduced_modulus_kPa());
  } else if (skin.layered() && skin.layer_law == LayerLaw::kExact) {
    exact_layer_ = std::make_shared<BondedLayer>(skin.poisson_ratio);
  }
}

double SphereLaw::layer_factor(double chi) const noexcept {
  return exact_layer_ ? exact_layer_->force_factor(chi)
                      : dimitriadis_factor(chi, skin_.poisson_ratio);
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

ContactState SphereLaw::elastic_at_depth(double depth_mm) const noexcept {
  if (sneddon_) return sneddon_->at_depth(depth_mm);
  ContactState contact = hertz_.at_depth(depth_mm);
  if (!skin_.layered() || !contact.touching()) return contact;
  const double chi = contact.contact_radius_mm / skin_.thickness_mm;
  contact.force_mN *= layer_factor(chi);
  if (exact_layer_) contact.contact_radius_mm *= exact_layer_->radius_factor(chi);
  contact.peak_pressure_kPa =
      1.5 * contact.force_mN /
      (std::numbers::pi * contact.contact_radius_mm * contact.contact_radius_mm);
  return contact;
}

ContactState SphereLaw::at_force(double force_mN) const noexcept {
  if (sneddon_ && !skin_.stiffens()) return sneddon_->at_force(force_mN);
  ContactState contact = hertz_.at_force(force_mN);
  if (!contact.touching() || (!skin_.layered() && !skin_.stiffens())) return contact;
  // A layer and stiffening make the skin stiffer, so the depth is below that of the half-space;
  // the force rises with the depth.
  const double deepest = sneddon_ ? sneddon_->at_force(force_mN).depth_mm : contact.depth_mm;
  contact = at_depth(
      bisected(0.0, deepest, [&](double depth) { return at_depth(depth).force_mN < force_mN; }));
  contact.force_mN = force_mN;
  return contact;
}

}  // namespace merkel
