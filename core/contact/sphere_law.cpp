#include "core/contact/sphere_law.hpp"

#include <cmath>
#include <numbers>

#include "core/math/bisection.hpp"

namespace merkel {

double dimitriadis_factor(double chi, double nu) noexcept {
  using std::numbers::pi;
  const double alpha = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1.0 - nu);
  const double beta = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1.0 - nu);
  const double alpha3 = alpha * alpha * alpha;
  const double c1 = -2.0 * alpha / pi;
  const double c2 = 4.0 * alpha * alpha / (pi * pi);
  const double c3 = -8.0 / std::pow(pi, 3) * (alpha3 + 4.0 * pi * pi / 15.0 * beta);
  const double c4 = 16.0 * alpha / std::pow(pi, 4) * (alpha3 + 3.0 * pi * pi / 5.0 * beta);
  return 1.0 + chi * (c1 + chi * (c2 + chi * (c3 + chi * c4)));
}

SphereLaw::SphereLaw(const SkinParameters& skin, double radius_mm)
    : hertz_(radius_mm, skin.radius_mm, SkinMaterial(skin).reduced_modulus_kPa()), skin_(skin) {
  if (skin.contact_law == ContactLaw::kSneddon) {
    sneddon_.emplace(hertz_.effective_radius_mm(), SkinMaterial(skin).reduced_modulus_kPa());
  }
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
  contact.force_mN *= dimitriadis_factor(chi, skin_.poisson_ratio);
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
