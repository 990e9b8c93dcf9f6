#include "tools/studies/reference/sneddon_contact.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

using reference::SneddonContact;

constexpr double kReducedModulus_kPa = 130.9;

/// Sneddon's general solution for a profile f(r): d = a·∫₀ᵃ f'(r)/√(a²−r²) dr and
/// F = 2E*·∫₀ᵃ (d − x·∫₀ˣ f'(r)/√(x²−r²) dr) dx, integrated numerically for a sphere.
struct General {
  double depth;
  double force;
};
General general(double R, double a) {
  const auto inner = [R](double x) {
    if (x == 0.0) return 0.0;
    return x * reference::integrate(
                   [R, x](double angle) {
                     const double r = x * std::sin(angle);
                     return r / std::sqrt(R * R - r * r);
                   },
                   0.0, std::asin(1.0));
  };
  const double depth = inner(a);
  const double force =
      2.0 * kReducedModulus_kPa *
      reference::integrate([&](double x) { return depth - inner(x); }, 0.0, a, 1e-11);
  return {depth, force};
}

TEST(SneddonContact, EqualsTheIntegralOverTheSphericalProfile) {
  const SneddonContact law(2.0, kReducedModulus_kPa);
  for (const double a : {0.01, 0.3, 1.0, 1.5, 1.9}) {
    const General expected = general(2.0, a);
    const SneddonContact::Contact contact = law.at_depth(expected.depth);
    EXPECT_NEAR(contact.contact_radius_mm / a, 1.0, 1e-9) << a;
    EXPECT_NEAR(contact.force_mN / expected.force, 1.0, 1e-9) << a;
  }
}

TEST(SneddonContact, DepartsFromHertzAsPublished) {
  const HertzContact hertz(1.0, std::numeric_limits<double>::infinity(), kReducedModulus_kPa);
  const SneddonContact sneddon(1.0, kReducedModulus_kPa);
  EXPECT_NEAR(sneddon.at_depth(0.3).force_mN / hertz.at_depth(0.3).force_mN, 0.970, 5e-4);
  EXPECT_NEAR(hertz.at_depth(0.3).contact_radius_mm / sneddon.at_depth(0.3).contact_radius_mm,
              1.053, 5e-4);
  EXPECT_NEAR(sneddon.at_depth(1.0).force_mN / hertz.at_depth(1.0).force_mN, 0.900, 5e-4);
  EXPECT_NEAR(hertz.at_depth(1.0).contact_radius_mm / sneddon.at_depth(1.0).contact_radius_mm, 1.20,
              5e-3);
}

TEST(SneddonContact, TendsToHertzForShallowPresses) {
  const HertzContact hertz(2.0, std::numeric_limits<double>::infinity(), kReducedModulus_kPa);
  const SneddonContact::Contact contact = SneddonContact(2.0, kReducedModulus_kPa).at_depth(1e-6);
  EXPECT_NEAR(contact.force_mN / hertz.at_depth(1e-6).force_mN, 1.0, 1e-6);
  EXPECT_NEAR(contact.peak_pressure_kPa / hertz.at_depth(1e-6).peak_pressure_kPa, 1.0, 1e-6);
}

TEST(SneddonContact, ForceInvertsToDepth) {
  const SneddonContact law(2.0, kReducedModulus_kPa);
  for (const double depth : {1e-5, 0.1, 1.5, 5.0, 20.0}) {
    EXPECT_NEAR(law.at_force(law.at_depth(depth).force_mN).depth_mm / depth, 1.0, 1e-9);
  }
  EXPECT_EQ(law.at_depth(0.0).force_mN, 0.0);
  EXPECT_EQ(law.at_force(-1.0).force_mN, 0.0);
}

}  // namespace
}  // namespace merkel
