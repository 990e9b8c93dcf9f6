#include "core/contact/contact_validity.hpp"

#include <algorithm>
#include <cmath>

#include "core/contact/solver/rigid_contact.hpp"
#include "core/contact/solver/tip_heights.hpp"
#include "core/math/bisection.hpp"
#include "core/printed.hpp"

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

/// The force of an exact sphere, F = E*·[(R²+a²)·artanh(a/R) − aR] at d = a·artanh(a/R): Sneddon,
/// Int. J. Engng Sci. 3 (1965) 47; divided by that of a paraboloid.
double exact_sphere_factor(double depth_ratio) {
  const double t = bisected(0.0, 1.0 + depth_ratio, [=](double artanh) {
    return std::tanh(artanh) * artanh < depth_ratio;
  });
  const double q = std::tanh(t);
  // For small q the terms cancel.
  const double force =
      q < 0.01 ? q * q * q * (4.0 / 3.0 + q * q * 8.0 / 15.0) : (1.0 + q * q) * t - q;
  return force / (4.0 / 3.0 * depth_ratio * std::sqrt(depth_ratio));
}

}  // namespace

ContactValidity validity_of(const ContactState& contact, const SkinParameters& skin,
                            double radius_mm) {
  ContactValidity validity;
  if (!contact.touching()) return validity;
  const double a = contact.contact_radius_mm;
  const double R = a * a / contact.depth_mm;
  validity.radius_ratio = a / std::min({radius_mm, skin.radius_mm, skin.finger_along_mm()});
  validity.sphere_force_error = 1.0 / exact_sphere_factor(contact.depth_mm / R) - 1.0;
  validity.layer_ratio = a / ContactValidity::kUsualThickness_mm;
  validity.layer_force_error =
      1.0 / layer_force_factor(validity.layer_ratio, skin.poisson_ratio) - 1.0;
  validity.within = validity.radius_ratio <= ContactValidity::kLargestRadiusRatio &&
                    validity.layer_ratio <= ContactValidity::kLargestHalfSpaceRatio;
  return validity;
}

std::string ContactValidity::sentence() const {
  std::string text = printed(
      "Hertz, whose force is %.1f %% above that of an exact sphere (a/R = %.3f, limit %.1f%s)",
      100.0 * sphere_force_error, radius_ratio, kLargestRadiusRatio,
      radius_ratio > kLargestRadiusRatio ? ": [skin] contact_law = \"sneddon\" solves the exact one"
                                         : "");
  if (layer_ratio > kLargestHalfSpaceRatio) {
    text += printed(
        "; on a half-space: with bone at %.0f mm, the force would be %.2f times as large (√(Rd)/h = "
        "%.3f, limit %.1f: [skin] thickness_mm = %.0f solves it)",
        kUsualThickness_mm, 1.0 / (1.0 + layer_force_error), layer_ratio, kLargestHalfSpaceRatio,
        kUsualThickness_mm);
  }
  return text;
}

}  // namespace merkel
