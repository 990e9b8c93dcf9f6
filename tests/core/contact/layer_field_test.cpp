#include "core/contact/layer_field.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/sphere_law.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/studies/reference/layer_finite_elements.hpp"

namespace merkel {
namespace {

SkinParameters layered(double thickness_mm) {
  return {.thickness_mm = thickness_mm, .layer_law = LayerLaw::kExact};
}

double energy(const AxisymmetricStress& stress, const SkinParameters& skin) {
  return energy_density_kPa(stress, SkinMaterial(skin), EnergyDensity::kDistortional);
}

// The finite elements converge with the square of their size: at 0.05 mm they are within 1 %.
TEST(LayerField, AgreesWithFiniteElements) {
  struct Case {
    double radius_mm, depth_mm;
  };
  for (const auto& [radius_mm, depth_mm] : {Case{2.0, 1.5}, Case{5.0, 1.0}}) {
    const SkinParameters skin = layered(4.0);
    const ContactState contact = SphereLaw(skin, radius_mm).at_depth(depth_mm);
    const LayerField field(skin, 4.0);
    const SkinMaterial material(skin);
    const reference::LayerFiniteElements elements(
        {.youngs_modulus_kPa = material.youngs_modulus_kPa(),
         .poisson_ratio = skin.poisson_ratio,
         .thickness_mm = skin.thickness_mm,
         .radius_mm = radius_mm,
         .depth_mm = depth_mm});
    EXPECT_NEAR(contact.force_mN / elements.force_mN(), 1.0, 0.01);
    EXPECT_NEAR(contact.contact_radius_mm, elements.contact_radius_mm(), 0.05);
    const double on_axis = energy(field.stress(contact, 0.0), skin);
    double largest = 0.0;
    for (double r = 0.0; r < 6.0; r += 0.1) {
      largest = std::max(largest, energy(field.stress(contact, r), skin));
    }
    for (double r = 0.0; r < 6.0; r += 0.25) {
      const AxisymmetricStress independent = elements.stress(r, skin.receptor_depth_mm);
      const double expected = energy(independent, skin);
      const double found = energy(field.stress(contact, r), skin);
      EXPECT_NEAR(found, expected, 0.02 * expected + 0.005 * largest) << radius_mm << " " << r;
    }
    // The error on the axis of a half-space under a semi-ellipse of the same force and radius.
    const double half_space =
        energy(huber_stress(contact, skin.poisson_ratio, 0.0, skin.receptor_depth_mm), skin);
    EXPECT_NEAR(1.0 - half_space / on_axis, radius_mm == 2.0 ? 0.26 : 0.42, 0.02);
  }
}

TEST(LayerField, MatchesTheHalfSpaceForThickSkin) {
  const SkinParameters skin = layered(200.0);
  const ContactState contact = SphereLaw(skin, 2.0).at_depth(1.0);
  const LayerField field(skin, 2.0);
  const ContactState hertz = SphereLaw({}, 2.0).at_depth(1.0);
  for (const double r : {0.0, 0.3, 1.0, 1.4, 2.0, 5.0}) {
    const AxisymmetricStress half_space = huber_stress(hertz, skin.poisson_ratio, r, 0.65);
    const double expected = energy(half_space, skin);
    EXPECT_NEAR(energy(field.stress(contact, r), skin) / expected, 1.0, 0.02) << r;
    // The bone reduces far displacements most.
    EXPECT_NEAR(field.displacement_mm(contact, r), HertzContact::surface_displacement_mm(hertz, r),
                0.01)
        << r;
  }
}

TEST(LayerField, SurfaceFollowsTheSphere) {
  const SkinParameters skin = layered(4.0);
  const ContactState contact = SphereLaw(skin, 5.0).at_depth(1.0);
  const LayerField field(skin, 4.0);
  for (double r = 0.0; r < contact.contact_radius_mm; r += 0.2) {
    EXPECT_NEAR(field.displacement_mm(contact, r), 1.0 - r * r / 10.0, 1e-3) << r;
  }
  EXPECT_NEAR(field.displacement_mm(contact, field.radius_of_displacement_mm(contact, 0.2)), 0.2,
              1e-5);
  EXPECT_EQ(field.radius_of_displacement_mm(contact, 1.1), 0.0);
  // The nearly incompressible skin bulges next to the contact.
  EXPECT_LT(field.displacement_mm(contact, 6.0), 0.0);
  EXPECT_EQ(field.displacement_mm(contact, 1e6), 0.0);
}

TEST(LayerField, ProfilesEqualTheStresses) {
  const SkinParameters skin = layered(3.0);
  const ContactState contact = SphereLaw(skin, 2.0).at_depth(0.7);
  const LayerField field(skin, 3.0);
  std::vector<double> values(field.points_within(4.0));
  field.profile(contact, LayerTable::kTauRz, values);
  for (std::size_t k = 1; k < values.size() - 3; ++k) {
    EXPECT_NEAR(values[k],
                field.stress(contact, static_cast<double>(k) * field.spacing_mm()).tau_rz, 1e-12);
  }
}

}  // namespace
}  // namespace merkel
