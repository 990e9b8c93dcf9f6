#include "core/contact/sphere_law.hpp"

#include <cmath>
#include <numbers>

#include "core/math/portable_math.hpp"

namespace merkel {

SphereLaw::SphereLaw(const SkinParameters& skin, double radius_mm)
    : hertz_(radius_mm, skin.radius_mm, SkinMaterial(skin).reduced_modulus_kPa()),
      thickness_mm_(skin.thickness_mm),
      stiffening_mm_(skin.stiffening_mm),
      poisson_ratio_(skin.poisson_ratio) {
  if (skin.contact_law == ContactLaw::kSneddon) {
    sneddon_.emplace(hertz_.effective_radius_mm(), SkinMaterial(skin).reduced_modulus_kPa());
  } else if (skin.layered() && skin.layer_law == LayerLaw::kExact) {
    exact_layer_ = std::make_shared<BondedLayer>(skin.poisson_ratio);
  }
}

double SphereLaw::layer_factor(double chi) const noexcept {
  return exact_layer_ ? exact_layer_->force_factor(chi) : dimitriadis_factor(chi, poisson_ratio_);
}

ContactState SphereLaw::at_depth(double depth_mm) const noexcept {
  ContactState contact = elastic_at_depth(depth_mm);
  if (std::isinf(stiffening_mm_) || !contact.touching()) return contact;
  contact.stiffening = portable_exp(contact.depth_mm / stiffening_mm_);
  contact.force_mN *= contact.stiffening;
  contact.peak_pressure_kPa *= contact.stiffening;
  return contact;
}

ContactState SphereLaw::elastic_at_depth(double depth_mm) const noexcept {
  if (sneddon_) return sneddon_->at_depth(depth_mm);
  ContactState contact = hertz_.at_depth(depth_mm);
  if (std::isinf(thickness_mm_) || !contact.touching()) return contact;
  const double chi = contact.contact_radius_mm / thickness_mm_;
  contact.force_mN *= layer_factor(chi);
  if (exact_layer_) contact.contact_radius_mm *= exact_layer_->radius_factor(chi);
  contact.peak_pressure_kPa =
      1.5 * contact.force_mN /
      (std::numbers::pi * contact.contact_radius_mm * contact.contact_radius_mm);
  return contact;
}

ContactState SphereLaw::at_force(double force_mN) const noexcept {
  const bool stiffens = !std::isinf(stiffening_mm_);
  if (sneddon_ && !stiffens) return sneddon_->at_force(force_mN);
  ContactState contact = hertz_.at_force(force_mN);
  if (!contact.touching() || (std::isinf(thickness_mm_) && !stiffens)) return contact;
  // A layer and stiffening make the skin stiffer, so the depth is below that of the half-space;
  // the force rises with the depth.
  double low = 0.0;
  double high = sneddon_ ? sneddon_->at_force(force_mN).depth_mm : contact.depth_mm;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    (at_depth(middle).force_mN < force_mN ? low : high) = middle;
  }
  contact = at_depth(high);
  contact.force_mN = force_mN;
  return contact;
}

}  // namespace merkel
