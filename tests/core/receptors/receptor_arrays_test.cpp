#include "core/receptors/receptor_arrays.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/studies/reference/flat_punch.hpp"

namespace merkel {
namespace {

constexpr double kX_mm = 14.3;
constexpr double kY_mm = 9.1;
constexpr double kStiffening = 1.7;

Indenter pin(double diameter_mm) { return {.tip = PinTip{.diameter_mm = diameter_mm}}; }

std::vector<Receptor> scattered() {
  Random random(5);
  std::vector<Receptor> receptors(3000);
  for (Receptor& each : receptors) {
    each.x_mm = 30.0 * random.uniform();
    each.y_mm = 20.0 * random.uniform();
  }
  return receptors;
}

/// The largest difference of the energy density under a pin from that of `stress(dx, dy)` at every
/// receptor, as a fraction of the largest energy density.
template <class Real, class Stress>
double error_under(const TipField& field, const SkinParameters& skin, double depth_mm,
                   Stress stress) {
  const std::vector<Receptor> receptors = scattered();
  ReceptorArrays<Real> arrays(receptors, skin, {});
  const PlacedContact placed{.contact = {.depth_mm = depth_mm, .stiffening = kStiffening},
                             .field = &field,
                             .x_mm = kX_mm,
                             .y_mm = kY_mm};
  arrays.press({&placed, 1}, 0, receptors.size());
  double largest = 0.0;
  double error = 0.0;
  for (std::size_t i = 0; i < receptors.size(); ++i) {
    const double exact = kStiffening * energy_density_kPa(stress(receptors[i].x_mm - kX_mm,
                                                                 receptors[i].y_mm - kY_mm),
                                                          SkinMaterial(skin), skin.energy_density);
    largest = std::max(largest, exact);
    error = std::max(error, std::fabs(arrays.energy_density_kPa(i) - exact));
  }
  EXPECT_GT(largest, 0.0);
  return error / largest;
}

TEST(ReceptorArrays, EnergyUnderAPinOnFlatSkinIsThatOfTheClosedForm) {
  for (const EnergyDensity kind : {EnergyDensity::kDistortional, EnergyDensity::kFull}) {
    for (const double diameter_mm : {0.5, 1.0, 6.35}) {
      const SkinParameters skin{.energy_density = kind};
      const double force_mN = 0.8 * diameter_mm * SkinMaterial(skin).reduced_modulus_kPa();
      const auto closed_form = [&](double dx, double dy) {
        return cartesian(
            reference::flat_punch_stress(force_mN, 0.5 * diameter_mm, skin.poisson_ratio,
                                         std::hypot(dx, dy), skin.receptor_depth_mm),
            dx, dy);
      };
      const TipField field(pin(diameter_mm), skin);
      EXPECT_LT(error_under<double>(field, skin, 0.8, closed_form), 0.02) << diameter_mm;
      EXPECT_LT(error_under<float>(field, skin, 0.8, closed_form), 0.02) << diameter_mm;
    }
  }
}

// A lone tip is remembered at every receptor: in place, moved, between other tables and beyond
// them.
TEST(ReceptorArrays, EnergyUnderOneTipIsThatOfItsStress) {
  const SkinParameters skin{.radius_mm = 7.0, .radius_along_mm = 14.0};
  const TipField field(pin(1.0), skin);
  for (const double depth_mm : {0.03, 0.031, 0.2, 1.0, 2.5}) {
    const auto at = [&](double dx, double dy) { return field.at(dx, dy, depth_mm).stress; };
    EXPECT_LT(error_under<double>(field, skin, depth_mm, at), 1e-3) << depth_mm;
  }
  const std::vector<Receptor> receptors = scattered();
  ReceptorArrays<double> arrays(receptors, skin, {});
  const auto energies = [&](double depth_mm, double x_mm) {
    ReceptorArrays<double> fresh(receptors, skin, {});
    const PlacedContact placed{
        .contact = {.depth_mm = depth_mm}, .field = &field, .x_mm = x_mm, .y_mm = kY_mm};
    arrays.press({&placed, 1}, 0, receptors.size());
    fresh.press({&placed, 1}, 0, receptors.size());
    for (std::size_t i = 0; i < receptors.size(); ++i) {
      ASSERT_EQ(arrays.energy_density_kPa(i), fresh.energy_density_kPa(i));
    }
  };
  for (const auto& [depth_mm, x_mm] :
       {std::pair{0.5, 14.3}, {0.51, 14.3}, {0.51, 15.0}, {0.02, 15.0}, {0.51, 14.3}}) {
    energies(depth_mm, x_mm);
  }
}

TEST(ReceptorArrays, EnergyUnderTwoTipsIsThatOfTheSumOfTheirStresses) {
  const SkinParameters skin{.radius_mm = 7.0, .radius_along_mm = 14.0};
  const TipField field(pin(1.0), skin);
  const std::vector<Receptor> receptors = scattered();
  ReceptorArrays<double> arrays(receptors, skin, {});
  const auto at_x = [&](double x_mm) {
    return PlacedContact{
        .contact = {.depth_mm = 0.5}, .field = &field, .x_mm = x_mm, .y_mm = kY_mm};
  };
  const std::array<PlacedContact, 2> both = {at_x(kX_mm), at_x(kX_mm + 1.2)};
  arrays.press(both, 0, receptors.size());
  double largest = 0.0;
  double error = 0.0;
  for (std::size_t i = 0; i < receptors.size(); ++i) {
    const double dx = receptors[i].x_mm - kX_mm;
    const double dy = receptors[i].y_mm - kY_mm;
    CartesianStress sum = field.at(dx, dy, 0.5).stress;
    sum += field.at(dx - 1.2, dy, 0.5).stress;
    const double exact = energy_density_kPa(sum, SkinMaterial(skin), skin.energy_density);
    largest = std::max(largest, exact);
    error = std::max(error, std::fabs(arrays.energy_density_kPa(i) - exact));
  }
  EXPECT_LT(error, 1e-9 * largest);
}

}  // namespace
}  // namespace merkel
