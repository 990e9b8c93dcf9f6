#include "core/contact/solver/press_tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/contact/solver/tip_heights.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/studies/reference/flat_punch.hpp"
#include "tools/studies/reference/flat_tip_boundary_elements.hpp"

namespace merkel {
namespace {

double energy_at(const PressTables& press, std::size_t table, double x_mm, double y_mm,
                 const SkinParameters& skin) {
  const PixelGrid& grid = press.grid;
  const auto index = [&](double at, std::size_t count) {
    return static_cast<std::size_t>(std::lround(at / grid.pixel_mm) + static_cast<long>(count / 2));
  };
  const PressTables::Table& of = press.tables[table];
  const CartesianStress stress =
      of.nodes[index(y_mm, grid.rows) * grid.columns + index(x_mm, grid.columns)].stress();
  return energy_density_kPa(stress * of.depth_mm, SkinMaterial(skin), EnergyDensity::kDistortional);
}

TEST(PressTables, TheFieldOfAPinIsItsClosedForm) {
  const SkinParameters skin;
  const LayeredMedium medium(skin);
  const PressTables press = press_tables({.gap = pin_height(1.0, 0.0),
                                          .half_width_mm = 0.5,
                                          .half_length_mm = 0.5,
                                          .feature_mm = 1.0,
                                          .proportional = true},
                                         medium, 0.65);
  const double force = press.tables[1].force_mN_per_mm;
  EXPECT_NEAR(force / medium.reduced_modulus_kPa(), 1.0, 0.005);
  const auto at = [&](std::size_t steps) {
    return press.grid.pixel_mm * static_cast<double>(steps);
  };
  for (const std::size_t i : {0U, 3U, 6U, 10U, 20U}) {
    for (const std::size_t j : {0U, 4U, 11U}) {
      const double exact = energy_density_kPa(
          reference::flat_punch_stress(medium.reduced_modulus_kPa(), 0.5, skin.poisson_ratio,
                                       std::hypot(at(i), at(j)), 0.65),
          SkinMaterial(skin), EnergyDensity::kDistortional);
      for (const double sign : {-1.0, 1.0}) {
        EXPECT_NEAR(energy_at(press, 1, sign * at(i), -sign * at(j), skin) / exact, 1.0, 0.01)
            << i << " " << j;
      }
    }
  }
}

// Energy density at 0.65 mm under a pin on a finger of 7 mm across and 14 mm along. The boundary
// elements converge from above as they become smaller: under the rim of the wide pin, 60 across are
// 2.5 % above their limit.
TEST(PressTables, APinOnAFingerOfTwoRadiiAgreesWithBoundaryElements) {
  const SkinParameters skin{.radius_mm = 7.0, .radius_along_mm = 14.0};
  const LayeredMedium medium(skin);
  for (const double diameter : {1.0, 6.35}) {
    const PressTables press =
        press_tables({.gap = above_finger(pin_height(diameter, 0.0), 14.0, 7.0, {}),
                      .half_width_mm = 0.5 * diameter,
                      .half_length_mm = 0.5 * diameter,
                      .feature_mm = diameter,
                      .deepest_mm = 2.0},
                     medium, 0.65);
    for (const std::size_t table : {press.tables.size() / 2, press.tables.size() - 1}) {
      const reference::FlatTipBoundaryElements elements(
          {.reduced_modulus_kPa = medium.reduced_modulus_kPa(),
           .poisson_ratio = skin.poisson_ratio,
           .width_mm = diameter,
           .length_mm = diameter,
           .round = true,
           .skin_radius_mm = 7.0,
           .skin_radius_along_mm = 14.0,
           .depth_mm = press.tables[table].depth_mm,
           .columns = 60,
           .rows = 60});
      const double force = press.tables[table].force_mN_per_mm * press.tables[table].depth_mm;
      EXPECT_NEAR(force / elements.force_mN(), 1.0, 0.015) << diameter << " " << table;
      const double rim = press.grid.pixel_mm * std::round(0.5 * diameter / press.grid.pixel_mm);
      for (const auto& [x, y] : {std::pair{0.0, 0.0}, {rim, 0.0}, {0.0, rim}}) {
        const double exact = energy_density_kPa(elements.stress(x, y, 0.65), SkinMaterial(skin),
                                                EnergyDensity::kDistortional);
        EXPECT_NEAR(energy_at(press, table, x, y, skin) / exact, 1.0, diameter > 2.0 ? 0.04 : 0.02)
            << diameter << " " << table << " " << x << " " << y;
      }
    }
  }
}

}  // namespace
}  // namespace merkel
