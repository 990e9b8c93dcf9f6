#include "core/contact/hertz_contact.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace merkel {

using std::numbers::pi;

HertzContact::HertzContact(double sphere_radius_mm, double skin_radius_mm,
                           double reduced_modulus_kPa) noexcept
    : effective_radius_mm_(1.0 / (1.0 / sphere_radius_mm + 1.0 / skin_radius_mm)),
      reduced_modulus_kPa_(reduced_modulus_kPa) {
  assert(std::isfinite(effective_radius_mm_) && effective_radius_mm_ > 0.0);
  assert(std::isfinite(reduced_modulus_kPa_) && reduced_modulus_kPa_ > 0.0);
}

ContactState HertzContact::at_depth(double depth_mm) const noexcept {
  if (!(depth_mm > 0.0)) return {};
  const double a = std::sqrt(effective_radius_mm_ * depth_mm);
  return {.depth_mm = depth_mm,
          .force_mN = 4.0 / 3.0 * reduced_modulus_kPa_ * depth_mm * a,
          .contact_radius_mm = a,
          .peak_pressure_kPa = 2.0 * reduced_modulus_kPa_ * a / (pi * effective_radius_mm_)};
}

ContactState HertzContact::at_force(double force_mN) const noexcept {
  if (!(force_mN > 0.0)) return {};
  const double root =
      std::cbrt(0.75 * force_mN / (reduced_modulus_kPa_ * std::sqrt(effective_radius_mm_)));
  return at_depth(root * root);
}

double HertzContact::pressure_kPa(const ContactState& contact, double r_mm) noexcept {
  const double a = contact.contact_radius_mm;
  if (!(r_mm < a)) return 0.0;
  return contact.peak_pressure_kPa * std::sqrt((1.0 - r_mm / a) * (1.0 + r_mm / a));
}

double HertzContact::surface_displacement_mm(const ContactState& contact, double r_mm) noexcept {
  const double a = contact.contact_radius_mm;
  const double d = contact.depth_mm;
  if (!(a > 0.0)) return 0.0;
  if (r_mm < a) return d * (1.0 - 0.5 * r_mm * r_mm / (a * a));
  const double q = a / r_mm;
  if (q < 0.05) {
    const double q2 = q * q;
    const double series =
        1.0 + q2 * (1.0 / 10.0 + q2 * (9.0 / 280.0 + q2 * (5.0 / 336.0 + q2 * (35.0 / 4224.0))));
    return 4.0 * d / (3.0 * pi) * q * series;
  }
  return d / (pi * a * a) *
         ((2.0 * a * a - r_mm * r_mm) * std::asin(q) + r_mm * a * std::sqrt((1.0 - q) * (1.0 + q)));
}

double HertzContact::radius_of_displacement_mm(const ContactState& contact,
                                               double displacement_mm) noexcept {
  if (!(surface_displacement_mm(contact, 0.0) >= displacement_mm)) return 0.0;
  // U(r) ≤ 2d·a/(π·r) for r ≥ a, so the radius lies below `high`.
  const double a = contact.contact_radius_mm;
  double low = 0.0;
  double high = std::max(a, 2.0 * contact.depth_mm * a / (pi * displacement_mm));
  while (high - low > 1e-6) {
    const double middle = 0.5 * (low + high);
    (surface_displacement_mm(contact, middle) >= displacement_mm ? low : high) = middle;
  }
  return low;
}

}  // namespace merkel
