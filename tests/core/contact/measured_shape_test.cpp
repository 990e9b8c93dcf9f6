#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/contact/pressed_tip.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/contact/tip_field.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tests/reference/flat_ends.hpp"

namespace merkel {
namespace {

constexpr double kNoShape = std::numeric_limits<double>::infinity();
constexpr double kMapPixel_mm = 0.05;
constexpr double kShapeDepth_mm = 0.3;
const SkinParameters kFlatSkin;
const double kFlatModulus = SkinMaterial(kFlatSkin).reduced_modulus_kPa();

/// A shape as a measured map, of heights at the centres of pixels.
Indenter measured(std::size_t columns, std::size_t rows,
                  const std::function<double(double, double)>& height) {
  HeightMap map{.grid = {.pixel_mm = kMapPixel_mm, .columns = columns, .rows = rows}};
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      map.height_mm.push_back(height(map.grid.x_mm(i), map.grid.y_mm(j)));
    }
  }
  return {.tip = ShapeTip{.pixel_mm = kMapPixel_mm,
                          .map = std::make_shared<const HeightMap>(std::move(map))}};
}

double sed_kPa(const CartesianStress& stress) {
  return energy_density_kPa(stress, SkinMaterial(kFlatSkin), kFlatSkin.energy_density);
}

/// The field of a tip, against that of flat ends.
void expect_ends(const Indenter& tip, const reference::FlatEnds& ends, const std::string& name) {
  const TipField field(tip, kFlatSkin);
  EXPECT_NEAR(field.force_mN(kShapeDepth_mm) / ends.force_mN, 1.0, 0.01) << name;
  double peak = 0.0;
  double off = 0.0;
  for (double y = -3.0; y <= 3.0; y += 0.31) {
    for (double x = -2.5; x <= 2.5; x += 0.23) {
      const double exact =
          sed_kPa(ends.stress(x, y, kFlatSkin.receptor_depth_mm, kFlatSkin.poisson_ratio));
      peak = std::max(peak, exact);
      off = std::max(off, std::fabs(sed_kPa(field.at(x, y, kShapeDepth_mm).stress) - exact));
    }
  }
  EXPECT_LT(off, 0.03 * peak) << name;
}

TEST(MeasuredShape, LettersAndBarsPressAsTheirStrokes) {
  const std::vector<reference::EndRectangle> letter{
      {-1.2, 0.0, 0.6, 5.0}, {0.3, 2.2, 2.4, 0.6}, {0.1, 0.0, 2.0, 0.6}, {0.3, -2.2, 2.4, 0.6}};
  const std::vector<reference::EndRectangle> bar{{0.0, 0.0, 1.0, 5.0}};
  for (const double base_mm : {kNoShape, 1.0}) {
    for (const auto* const ends : {&letter, &bar}) {
      const auto height = [&](double x, double y) {
        const bool inside = std::any_of(ends->begin(), ends->end(), [&](const auto& end) {
          return std::fabs(x - end.x_mm) < 0.5 * end.width_mm &&
                 std::fabs(y - end.y_mm) < 0.5 * end.length_mm;
        });
        return inside ? 0.0 : base_mm;
      };
      expect_ends(measured(80, 120, height),
                  reference::pressed_rectangles(*ends, kShapeDepth_mm, kFlatModulus, 12),
                  (ends == &letter ? "letter " : "bar ") + std::to_string(base_mm));
    }
  }
}

TEST(MeasuredShape, CoinsAndRingsPressAsTheirEnds) {
  for (const auto& [inner, outer] : {std::pair{0.0, 1.0}, {0.7, 1.3}}) {
    for (const double base_mm : {kNoShape, 1.0}) {
      const auto height = [&, inner = inner, outer = outer](double x, double y) {
        const double r = std::hypot(x, y);
        return r >= inner && r <= outer ? 0.0 : base_mm;
      };
      expect_ends(measured(60, 60, height),
                  reference::pressed_ring(inner, outer, kShapeDepth_mm, kFlatModulus, 60),
                  std::to_string(inner) + " " + std::to_string(base_mm));
    }
  }
  EXPECT_NEAR(reference::pressed_ring(0.0, 1.0, 1.0, 1.0, 60).force_mN, 2.0, 0.002);
}

TEST(MeasuredShape, RoundedDotsAreHertzsAndPointedOnesSneddons) {
  // An even number of columns, so that the middle of the map is no pixel: the dots are off centre.
  const double half = 0.5 * kMapPixel_mm;
  const TipField rounded(measured(60, 60,
                                  [&](double x, double y) {
                                    return std::pow(std::hypot(x - half, y - half), 2) / 3.0;
                                  }),
                         kFlatSkin);
  const double slope = 1.0 / std::tan(std::numbers::pi / 3.0);
  const TipField pointed({.tip = ConeTip{.diameter_mm = 3.0, .angle_deg = 120.0}}, kFlatSkin);
  for (const double depth : {0.05, 0.08, 0.13, 0.21, 0.33}) {
    EXPECT_NEAR(rounded.force_mN(depth) /
                    (4.0 / 3.0 * kFlatModulus * std::sqrt(1.5) * std::pow(depth, 1.5)),
                1.0, 0.01)
        << depth;
    EXPECT_NEAR(
        pointed.force_mN(depth) / (2.0 * kFlatModulus * depth * depth / (std::numbers::pi * slope)),
        1.0, 0.01)
        << depth;
  }
}

TEST(MeasuredShape, SharpTipsAreResolvedFromAFiftiethOfAMillimetreOn) {
  for (const double angle : {90.0, 120.0, 150.0}) {
    const double slope = 1.0 / std::tan(0.5 * angle * std::numbers::pi / 180.0);
    const TipField cone({.tip = ConeTip{.diameter_mm = 3.0, .angle_deg = angle}}, kFlatSkin);
    for (const double depth : {0.02, 0.027, 0.04, 0.1, 0.3}) {
      const double area = 4.0 * depth * depth / (std::numbers::pi * slope * slope);
      const double force = 2.0 * kFlatModulus * depth * depth / (std::numbers::pi * slope);
      EXPECT_NEAR(cone.force_mN(depth) / force, 1.0, 0.02) << angle << " " << depth;
      EXPECT_NEAR(cone.mean_pressure_kPa(depth) / (force / area), 1.0, 0.02)
          << angle << " " << depth;
    }
  }
}

TEST(MeasuredShape, ASecondLevelBeginsToTouchAtItsOwnDepth) {
  const Indenter steps = measured(60, 60, [](double x, double y) {
    if (std::fabs(x) < 0.5 && std::fabs(y) < 0.5) return 0.0;
    return std::fabs(x) < 1.2 && std::fabs(y) < 1.2 ? 0.3 : 1.5;
  });
  const TipField field(steps, kFlatSkin);
  for (double depth = 0.31; depth < 0.9; depth += 0.083) {
    const TipField exact(steps, kFlatSkin, depth);
    EXPECT_NEAR(field.force_mN(depth) / exact.force_mN(depth), 1.0, 0.005) << depth;
    const double largest = exact.largest_energy_kPa(depth);
    for (double x = -2.0; x < 2.0; x += 0.23) {
      EXPECT_NEAR(sed_kPa(field.at(x, 0.2, depth).stress), sed_kPa(exact.at(x, 0.2, depth).stress),
                  0.02 * largest)
          << depth << " " << x;
    }
  }
}

TEST(MeasuredShape, ItsAreaStiffensTheSkinAsAClosedFormDoes) {
  // F0/(1 − p0/p1), with the mean pressure p0 of Sneddon's cone at that depth.
  SkinParameters skin;
  skin.stiffening_kPa = 150.0;
  const double slope = 1.0 / std::tan(75.0 * std::numbers::pi / 180.0);
  const TipContact cone({.tip = ConeTip{.diameter_mm = 6.0, .angle_deg = 150.0}}, skin);
  for (const double depth : {0.05, 0.11, 0.3, 0.52}) {
    const double force = 2.0 * kFlatModulus * depth * depth / (std::numbers::pi * slope);
    const double pressure = 0.5 * kFlatModulus * slope;
    EXPECT_NEAR(cone.press({.depth_mm = depth}).contact.force_mN /
                    (force / (1.0 - pressure / skin.stiffening_kPa)),
                1.0, 0.01)
        << depth;
  }
}

}  // namespace
}  // namespace merkel
