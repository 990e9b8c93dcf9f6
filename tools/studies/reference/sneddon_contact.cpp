#include "tools/studies/reference/sneddon_contact.hpp"

#include <cassert>
#include <cmath>
#include <numbers>

namespace merkel::reference {
namespace {

/// d/R as a function of q = a/R: q·atanh(q).
double depth_ratio(double q) { return q * std::atanh(q); }

/// F/(E*R²): (1+q²)·atanh(q) − q. For small q the terms cancel to ⁴⁄₃·q³, so a series is used.
double force_ratio(double q) {
  const double q2 = q * q;
  if (q < 0.05) {
    return q * q2 *
           (4.0 / 3.0 +
            q2 * (8.0 / 15.0 + q2 * (12.0 / 35.0 + q2 * (16.0 / 63.0 + q2 * (20.0 / 99.0)))));
  }
  return (1.0 + q2) * std::atanh(q) - q;
}

/// The q in [0, 1) at which a rising function takes a value. Bisection on t = atanh(q) covers
/// every depth.
template <class Function>
double solve(Function f, double value) {
  double low = 0.0;
  double high = 1.0;
  while (high < 16.0 && f(std::tanh(high)) < value) high *= 2.0;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    (f(std::tanh(middle)) < value ? low : high) = middle;
  }
  return std::tanh(0.5 * (low + high));
}

}  // namespace

SneddonContact::SneddonContact(double radius_mm, double reduced_modulus_kPa) noexcept
    : radius_mm_(radius_mm), reduced_modulus_kPa_(reduced_modulus_kPa) {
  assert(std::isfinite(radius_mm_) && radius_mm_ > 0.0);
}

SneddonContact::Contact SneddonContact::at_radius_ratio(double q) const noexcept {
  const double a = q * radius_mm_;
  const double force = reduced_modulus_kPa_ * radius_mm_ * radius_mm_ * force_ratio(q);
  return {.depth_mm = radius_mm_ * depth_ratio(q),
          .force_mN = force,
          .contact_radius_mm = a,
          .peak_pressure_kPa = 1.5 * force / (std::numbers::pi * a * a)};
}

SneddonContact::Contact SneddonContact::at_depth(double depth_mm) const noexcept {
  if (!(depth_mm > 0.0)) return {};
  Contact contact = at_radius_ratio(solve(depth_ratio, depth_mm / radius_mm_));
  contact.depth_mm = depth_mm;
  return contact;
}

SneddonContact::Contact SneddonContact::at_force(double force_mN) const noexcept {
  if (!(force_mN > 0.0)) return {};
  const double scale = reduced_modulus_kPa_ * radius_mm_ * radius_mm_;
  Contact contact = at_radius_ratio(solve(force_ratio, force_mN / scale));
  contact.force_mN = force_mN;
  return contact;
}

}  // namespace merkel::reference
