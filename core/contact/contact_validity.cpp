#include "core/contact/contact_validity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/sneddon_contact.hpp"
#include "core/contact/solver/rigid_contact.hpp"
#include "core/contact/solver/tip_heights.hpp"

namespace merkel {
namespace {

/// The force on a layer bonded to bone divided by that on a half-space, at the same depth: solved
/// in units of the thickness, with R = 1.
double layer_force_factor(double chi, double poisson_ratio) {
  constexpr std::size_t kAcross = 63;
  constexpr double kThinnest = 50.0;  // thinner layers are at least as stiff
  const double radius = std::min(chi, kThinnest);
  if (!(radius > 0.0)) return 1.0;
  const SkinLayer layer{
      .thickness_mm = 1.0, .youngs_modulus_kPa = 1.0, .poisson_ratio = poisson_ratio};
  // An incompressible thin layer touches within twice the radius of a half-space.
  const PixelGrid grid{
      .pixel_mm = 4.0 * radius / (kAcross - 1), .columns = kAcross, .rows = kAcross};
  RigidContact solver(LayeredMedium({layer}), height_map(sphere_height(1.0), grid));
  return solver.press(radius * radius, {.tolerance = 1e-4}).force_mN /
         (4.0 / 3.0 * layer.reduced_modulus_kPa() * radius * radius * radius);
}

}  // namespace

ContactValidity validity_of(const ContactState& contact, const SkinParameters& skin,
                            double radius_mm) {
  ContactValidity validity;
  validity.thickness_given = skin.layered();
  if (skin.layered()) {
    validity.thickness_mm = skin.thickness_mm;
    validity.largest_layer_ratio = ContactValidity::kLargestDimitriadisRatio;
  }
  if (!contact.touching()) return validity;

  const double modulus = SkinMaterial(skin).reduced_modulus_kPa();
  const HertzContact hertz(radius_mm, skin.radius_mm, modulus);
  const double R = hertz.effective_radius_mm();
  const double depth = contact.depth_mm;
  const double hertz_force = hertz.at_depth(depth).force_mN;
  validity.radius_ratio = contact.contact_radius_mm / std::min(radius_mm, skin.radius_mm);
  validity.exact_sphere = skin.contact_law == ContactLaw::kSneddon;
  if (!validity.exact_sphere) {
    validity.sphere_force_error =
        hertz_force / SneddonContact(R, modulus).at_depth(depth).force_mN - 1.0;
  }
  validity.layer_ratio = std::sqrt(R * depth) / validity.thickness_mm;
  const double exact_factor = layer_force_factor(validity.layer_ratio, skin.poisson_ratio);
  const double used_factor =
      skin.layered() ? contact.force_mN / (contact.stiffening * hertz_force) : 1.0;
  validity.layer_force_error = used_factor / exact_factor - 1.0;
  validity.within =
      (validity.exact_sphere || validity.radius_ratio <= ContactValidity::kLargestRadiusRatio) &&
      validity.layer_ratio <= validity.largest_layer_ratio;
  return validity;
}

std::string ContactValidity::sentence() const {
  std::array<char, 600> text{};
  int length = 0;
  const auto append = [&](const char* format, auto... values) {
    const auto used = static_cast<std::size_t>(length);
    length += std::snprintf(text.data() + used, text.size() - used, format, values...);
  };
  append("a/R = %.3f", radius_ratio);
  if (exact_sphere) {
    append("%s", " (exact sphere)");
  } else {
    append(" (%s the limit %.1f; the force is %.1f %% above that of an exact sphere)",
           radius_ratio <= kLargestRadiusRatio ? "within" : "beyond", kLargestRadiusRatio,
           100.0 * sphere_force_error);
  }
  if (thickness_given) {
    append("; √(Rd)/h = %.3f (%s %.2g; force error against skin bonded to bone %.1f %%)",
           layer_ratio, layer_ratio <= largest_layer_ratio ? "within" : "beyond",
           largest_layer_ratio, 100.0 * layer_force_error);
  } else if (layer_ratio > kLargestHalfSpaceRatio) {
    append(
        "; the skin is modelled as a half-space: bone at a depth of %.0f mm (√(Rd)/h = %.3f) "
        "would make the force %.2f times as large (set skin.thickness_mm)",
        thickness_mm, layer_ratio, 1.0 / (1.0 + layer_force_error));
  }
  return text.data();
}

}  // namespace merkel
