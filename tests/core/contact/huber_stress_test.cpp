#include "core/contact/huber_stress.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/skin/point_load.hpp"
#include "tests/sweep.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

constexpr double kA = 1.7320508075688772;
constexpr double kP0 = 72.16902458;

ContactState disc() {
  return {.depth_mm = 1.5,
          .force_mN = 2.0 / 3.0 * 3.14159265358979323846 * kA * kA * kP0,
          .contact_radius_mm = kA,
          .peak_pressure_kPa = kP0};
}

/// Largest difference of any component, relative to the largest component.
double difference(const AxisymmetricStress& ours, const reference::Stress& theirs) {
  const double scale = std::max(
      {std::fabs(theirs.r), std::fabs(theirs.theta), std::fabs(theirs.z), std::fabs(theirs.rz)});
  return std::max({std::fabs(ours.sigma_r - theirs.r), std::fabs(ours.sigma_theta - theirs.theta),
                   std::fabs(ours.sigma_z - theirs.z), std::fabs(ours.tau_rz - theirs.rz)}) /
         scale;
}

// The superposition has converged to 1e-12. The closed form loses a few digits far from the
// contact, where σ is small relative to p0.
TEST(HuberStress, EqualsTheSuperpositionOfPointLoadsEverywhere) {
  Random random(1);
  for (int k = 0; k < 1000; ++k) {
    const double r = random.uniform(0.0, 2.0) * (k % 3 == 0 ? 10.0 : 1.5);
    const double z = std::exp(random.uniform(std::log(1e-9), std::log(30.0)));
    const double nu = std::array{0.0, 0.3, 0.48, 0.5}[static_cast<std::size_t>(k % 4)];
    const double from_rim = std::hypot(r - kA, z);
    if (from_rim < 0.05 || !in_sweep(static_cast<std::size_t>(k), 11)) continue;
    EXPECT_LE(
        difference(huber_stress(disc(), nu, r, z), reference::superposed_stress(kP0, kA, nu, r, z)),
        1e-10)
        << "r = " << r << ", z = " << z << ", nu = " << nu;
  }
}

TEST(HuberStress, SurfaceUnderTheContactBearsThePressure) {
  for (const double r : {0.0, 0.5, 1.0, 1.7}) {
    const double expected = -kP0 * std::sqrt(1.0 - r * r / (kA * kA));
    EXPECT_NEAR(huber_stress(disc(), 0.48, r, 0.0).sigma_z, expected, 1e-12 * kP0);
    EXPECT_EQ(huber_stress(disc(), 0.48, r, 0.0).tau_rz, 0.0);
  }
}

TEST(HuberStress, SurfaceOutsideTheContactIsFreeOfTraction) {
  for (const double r : {kA, 1.8, 3.0, 20.0}) {
    EXPECT_EQ(huber_stress(disc(), 0.48, r, 0.0).sigma_z, 0.0);
    EXPECT_EQ(huber_stress(disc(), 0.48, r, 0.0).tau_rz, 0.0);
  }
}

TEST(HuberStress, IsFiniteOnTheAxisTheSurfaceAndTheRim) {
  for (const double r : {0.0, 1e-300, kA, std::nextafter(kA, 0.0), std::nextafter(kA, 9.0)}) {
    for (const double z : {0.0, 1e-300, 1e-9}) {
      const auto stress = huber_stress(disc(), 0.48, r, z);
      EXPECT_TRUE(std::isfinite(stress.sigma_r) && std::isfinite(stress.sigma_theta) &&
                  std::isfinite(stress.sigma_z) && std::isfinite(stress.tau_rz))
          << "r = " << r << ", z = " << z;
    }
  }
}

TEST(HuberStress, RadialAndHoopStressAgreeOnTheAxis) {
  const auto stress = huber_stress(disc(), 0.48, 0.0, 0.65);
  EXPECT_NEAR(stress.sigma_r, stress.sigma_theta, 1e-12 * kP0);
}

TEST(HuberStress, TendsToThePointLoadFarAway) {
  const double far = 1000.0 * kA;
  const auto near_field = huber_stress(disc(), 0.3, 0.6 * far, 0.8 * far);
  const auto point = point_load_stress(disc().force_mN, 0.3, 0.6 * far, 0.8 * far);
  EXPECT_NEAR(near_field.sigma_r / point.sigma_r, 1.0, 1e-4);
  EXPECT_NEAR(near_field.sigma_z / point.sigma_z, 1.0, 1e-4);
  EXPECT_NEAR(near_field.tau_rz / point.tau_rz, 1.0, 1e-4);
}

TEST(HuberStress, NoContactNoStress) {
  const auto stress = huber_stress({}, 0.48, 1.0, 0.65);
  EXPECT_EQ(stress.sigma_z, 0.0);
  EXPECT_EQ(stress.sigma_r, 0.0);
}

}  // namespace
}  // namespace merkel
