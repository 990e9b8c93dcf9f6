#include "core/skin/skin_material.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(SkinMaterial, DefaultModulusIsTheReussMeanOfEpidermisAndDermis) {
  EXPECT_NEAR(SkinMaterial(SkinParameters{}).youngs_modulus_kPa(), 100.740741, 5e-7);
}

TEST(SkinMaterial, ShearModulusIsThatOfIsotropicElasticity) {
  const SkinMaterial skin(100.0, 0.25);
  EXPECT_DOUBLE_EQ(skin.shear_modulus_kPa(), 40.0);
}

TEST(SkinMaterial, ElasticIndenterOfTheSameMaterialHalvesTheReducedModulus) {
  const SkinMaterial skin(100.0, 0.3);
  EXPECT_DOUBLE_EQ(skin.reduced_modulus_kPa(skin), 0.5 * skin.reduced_modulus_kPa());
}

TEST(SkinMaterial, ARigidIndenterIsTheLimitOfAStiffOne) {
  const SkinMaterial skin(100.0, 0.3);
  const SkinMaterial steel(2e8, 0.3);
  EXPECT_NEAR(skin.reduced_modulus_kPa(steel) / skin.reduced_modulus_kPa(), 1.0, 1e-6);
}

TEST(SkinParameters, StiffenWithTheDepthOfAPress) {
  const SkinParameters skin{.stiffening_mm = 1.65};
  EXPECT_NEAR(skin.stiffening_at(1.65, 0.0), std::exp(1.0), 1e-13);
  EXPECT_EQ(skin.stiffening_at(-1.0, 0.0), 1.0) << "no contact";
  EXPECT_EQ(SkinParameters{}.stiffening_at(3.0, 50.0), 1.0);
}

// E = E0(1 + p/p1), with the actual mean pressure p = p0·E/E0.
TEST(SkinParameters, StiffenWithTheMeanPressureOfAPress) {
  const SkinParameters skin{.stiffening_kPa = 10.5};
  for (const double rest_kPa : {0.0, 1.0, 5.0, 9.0}) {
    const double stiffening = skin.stiffening_at(1.0, rest_kPa);
    EXPECT_NEAR(stiffening, 1.0 + stiffening * rest_kPa / 10.5, 1e-12);
    EXPECT_NEAR(skin.stiffening_under(1.0, stiffening * rest_kPa), stiffening, 1e-12);
  }
  EXPECT_EQ(skin.stiffening_at(1.0, 100.0), SkinParameters::kMaxStiffening);
  const auto both = SkinParameters{.stiffening_mm = 1.0, .stiffening_kPa = 1.0}.check();
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().key, "skin.stiffening_kPa");
}

TEST(SkinParameters, AFingerWithoutARadiusAlongItIsRound) {
  EXPECT_EQ((SkinParameters{.radius_mm = 7.0}).finger_along_mm(), 7.0);
  EXPECT_EQ((SkinParameters{.radius_mm = 7.0, .radius_along_mm = 14.0}).finger_along_mm(), 14.0);
}

TEST(SkinParameters, RefuseInvalidValues) {
  const auto key_of = [](const SkinParameters& skin) {
    const auto checked = skin.check();
    return checked ? std::string("none") : checked.error().key;
  };
  EXPECT_EQ(key_of({}), "none");
  EXPECT_EQ(key_of({.epidermis_kPa = -1.0}), "skin.epidermis_kPa");
  EXPECT_EQ(key_of({.dermis_kPa = 0.0}), "skin.dermis_kPa");
  EXPECT_EQ(key_of({.poisson_ratio = 0.5}), "skin.poisson_ratio");
  EXPECT_EQ(key_of({.poisson_ratio = -0.1}), "skin.poisson_ratio");
  EXPECT_EQ(key_of({.poisson_ratio = std::numeric_limits<double>::quiet_NaN()}),
            "skin.poisson_ratio");
  EXPECT_EQ(key_of({.radius_mm = 0.0}), "skin.radius_mm");
  EXPECT_EQ(key_of({.receptor_depth_mm = -0.1}), "skin.receptor_depth_mm");
}

}  // namespace
}  // namespace merkel
