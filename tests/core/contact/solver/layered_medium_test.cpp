#include "core/contact/solver/layered_medium.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/skin/point_load.hpp"
#include "tools/studies/reference/bonded_layer.hpp"

namespace merkel {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

LayeredMedium medium(std::vector<SkinLayer> layers) { return LayeredMedium(std::move(layers)); }

SkinLayer layer(double thickness_mm, double modulus_kPa, double nu) {
  return {.thickness_mm = thickness_mm, .youngs_modulus_kPa = modulus_kPa, .poisson_ratio = nu};
}

TEST(PointResponse, OnAHalfSpaceItIsBoussinesqs) {
  const PointResponse response(medium({layer(kInfinite, 100.0, 0.48)}), 0.65, 1e-6, 30.0);
  for (const double r : {0.0, 0.1, 0.5, 1.0, 3.0, 10.0, 25.0}) {
    const AxisymmetricStress ours = response.stress(r);
    const AxisymmetricStress exact = point_load_stress(1.0, 0.48, r, 0.65);
    const double tolerance = 1e-4 * std::fabs(exact.sigma_r) + 1e-9;
    EXPECT_NEAR(ours.sigma_r, exact.sigma_r, tolerance) << r;
    EXPECT_NEAR(ours.sigma_theta, exact.sigma_theta, tolerance) << r;
    EXPECT_NEAR(ours.sigma_z, exact.sigma_z, tolerance) << r;
    EXPECT_NEAR(ours.tau_rz, exact.tau_rz, tolerance) << r;
    EXPECT_EQ(response.excess_displacement_mm(r), 0.0);
  }
}

TEST(LayeredMedium, OneBondedLayerHasThePublishedCompliance) {
  // 1 − K of Lebedev & Ufliand (1958).
  for (const double nu : {0.2, 0.48, 0.5}) {
    const LayeredMedium skin = medium({layer(4.0, 100.0, nu)});
    for (const double x : {0.01, 0.1, 0.5, 1.0, 5.0}) {
      EXPECT_NEAR(skin.excess_compliance(x / 4.0), -reference::BondedLayer::stiffening(x, nu),
                  1e-9);
    }
  }
}

TEST(LayeredMedium, LayersOfOneMaterialAreOne) {
  const LayeredMedium one = medium({layer(4.0, 100.0, 0.48)});
  const LayeredMedium three =
      medium({layer(0.1, 100.0, 0.48), layer(1.4, 100.0, 0.48), layer(2.5, 100.0, 0.48)});
  for (const double xi : {0.01, 0.3, 2.0, 20.0, 400.0}) {
    for (const double z : {0.05, 0.65, 3.0}) {
      const LayeredMedium::Response a = one.response(xi, z);
      const LayeredMedium::Response b = three.response(xi, z);
      EXPECT_NEAR(a.radial, b.radial, 1e-9) << xi << " " << z;
      EXPECT_NEAR(a.gradient, b.gradient, 1e-9);
      EXPECT_NEAR(a.dilatation, b.dilatation, 1e-9);
      EXPECT_NEAR(a.shear, b.shear, 1e-9);
    }
    EXPECT_NEAR(one.excess_compliance(xi), three.excess_compliance(xi), 1e-9);
  }
}

TEST(LayeredMedium, LongWavesSeeTheLowestLayerAndShortOnesTheFirst) {
  const SkinLayer stiff = layer(0.1, 1e5, 0.3);
  const SkinLayer soft = layer(kInfinite, 100.0, 0.48);
  const LayeredMedium skin = medium({stiff, soft});
  const double ratio = stiff.reduced_modulus_kPa() / soft.reduced_modulus_kPa();
  EXPECT_NEAR(skin.excess_compliance(1e-4) / (ratio - 1.0), 1.0, 1e-3);
  EXPECT_NEAR(skin.excess_compliance(400.0), 0.0, 1e-9);
  // Its stress reaches equilibrium with the load: σz of a long wave is −p at any depth.
  const LayeredMedium::Response deep = skin.response(1e-3, 5.0);
  EXPECT_NEAR(deep.gradient + deep.poisson_ratio * deep.dilatation, -1.0, 1e-3);
}

TEST(LayeredMedium, NearlyIncompressibleThinLayersApproachTheIncompressible) {
  const auto bonded = [](double nu) {
    return medium({layer(0.2, 136.0, nu), layer(1.0, 80.0, nu)});
  };
  for (const double xi : {0.05, 0.5, 5.0, 50.0}) {
    const double limit = 1.0 + bonded(0.5).excess_compliance(xi);
    double before = kInfinite;
    for (const double nu : {0.499, 0.4999, 0.49999}) {
      const double error = std::fabs((1.0 + bonded(nu).excess_compliance(xi)) / limit - 1.0);
      EXPECT_LT(error, 0.2 * before) << xi;
      before = error;
    }
    // Squeezing a thin layer costs (ξh)^−2 times (1−2ν).
    EXPECT_LT(before, 0.02) << xi;
    EXPECT_GT(limit, 0.0);
  }
}

}  // namespace
}  // namespace merkel
