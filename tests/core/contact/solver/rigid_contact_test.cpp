#include "core/contact/solver/rigid_contact.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/solver/tip_heights.hpp"
#include "tools/studies/reference/bonded_layer.hpp"

namespace merkel {
namespace {

using std::numbers::pi;

constexpr RigidContact::Accuracy kFine{.tolerance = 1e-5, .most_iterations = 400};
constexpr double kStraight = std::numeric_limits<double>::infinity();

const LayeredMedium kHalfSpace(SkinParameters{});
const double kSkinModulus = kHalfSpace.reduced_modulus_kPa();

RigidContact contact(const TipHeight& tip, double pixel_mm, std::size_t columns, std::size_t rows,
                     const LayeredMedium& skin = kHalfSpace) {
  return {skin, height_map(tip, {.pixel_mm = pixel_mm, .columns = columns, .rows = rows})};
}

RigidContact::Solution press_with_force(RigidContact& solver, double force_mN) {
  solver.begin_with_force(force_mN, kStraight);
  while (!solver.iterate(kFine)) {
  }
  return solver.solution();
}

TEST(GridTransform, ConvolvesWithoutPeriodicImages) {
  GridTransform transform(32, 64);
  const auto value = [](std::size_t k) { return static_cast<double>(k * 7919 % 101) - 50.0; };
  std::vector<double> image(11 * 9), kernel(32 * 64), result(20 * 17);
  for (std::size_t k = 0; k < image.size(); ++k) image[k] = value(k);
  for (std::size_t k = 0; k < kernel.size(); ++k) kernel[k] = value(k + 13);
  GridSpectrum a = transform.make_spectrum();
  GridSpectrum b = transform.make_spectrum();
  transform.forward(image, 11, 9, a);
  transform.forward(kernel, 32, 64, b);
  transform.convolve(a, b, 20, 17, result);
  for (std::size_t y = 0; y < 17; ++y) {
    for (std::size_t x = 0; x < 20; ++x) {
      double sum = 0.0;
      for (std::size_t j = 0; j < 9; ++j) {
        for (std::size_t i = 0; i < 11; ++i) {
          sum += image[j * 11 + i] * kernel[(y + 64 - j) % 64 * 32 + (x + 32 - i) % 32];
        }
      }
      EXPECT_NEAR(result[y * 20 + x], sum, 1e-8);
    }
  }
}

TEST(RigidContact, ASphereIsHertzs) {
  const HertzContact hertz(5.0, kStraight, kSkinModulus);
  for (const double depth : {0.3, 1.0}) {
    RigidContact solver = contact(sphere_height(5.0), 0.1, 61, 61);
    const RigidContact::Solution solution = solver.press(depth, kFine);
    const ContactState exact = hertz.at_depth(depth);
    EXPECT_TRUE(solution.converged);
    EXPECT_NEAR(solution.force_mN / exact.force_mN, 1.0, 0.005);
    EXPECT_NEAR(solution.peak_pressure_kPa / exact.peak_pressure_kPa, 1.0, 0.005);
    EXPECT_NEAR(std::sqrt(solution.area_mm2 / pi) / exact.contact_radius_mm, 1.0, 0.02);
  }
}

TEST(RigidContact, APlateOnAFingerIsEllipticHertz) {
  // Johnson, Contact Mechanics, section 4.2; the radii that belong to an eccentricity e.
  const double e = 0.75;
  const double k = std::comp_ellint_1(e);
  const double l = std::comp_ellint_2(e);
  const double b_over_a = std::sqrt(1.0 - e * e);
  const double a = 2.0;
  const double b = b_over_a * a;
  const double p0 = 50.0;
  const double along = p0 / kSkinModulus * b / (e * e * a * a) * (k - l);  // 1/2R'
  const double across = p0 / kSkinModulus * b / (e * e * a * a) * (a * a / (b * b) * l - k);
  const double depth = p0 / kSkinModulus * b * k;
  const TipHeight plate = [](double, double) { return 0.0; };
  RigidContact solver = contact(above_finger(plate, 0.5 / along, 0.5 / across, {}), 0.08, 61, 47);
  const RigidContact::Solution solution = solver.press(depth, kFine);
  EXPECT_NEAR(solution.force_mN / (2.0 / 3.0 * p0 * pi * a * b), 1.0, 0.005);
  EXPECT_NEAR(solution.peak_pressure_kPa / p0, 1.0, 0.005);
  // The same finger turned by 90 degrees.
  RigidContact turned_finger =
      contact(above_finger(plate, 0.5 / across, 0.5 / along, {}), 0.08, 47, 61);
  EXPECT_NEAR(turned_finger.press(depth, kFine).force_mN / solution.force_mN, 1.0, 1e-4);
}

TEST(RigidContact, TheRimOfAFlatEndActsWhereItIs) {
  // F = 2aE*d at six to twenty pixels across, wherever the rim lies in its pixel.
  for (const double pixel : {0.16, 0.125, 0.08, 0.05}) {
    for (const double diameter : {1.0, 1.03, 1.07}) {
      const auto across = 2 * static_cast<std::size_t>(std::ceil(0.5 * diameter / pixel)) + 1;
      RigidContact solver = contact(pin_height(diameter, 0.0), pixel, across, across);
      const RigidContact::Solution solution = solver.press(0.5, kFine);
      EXPECT_NEAR(solution.force_mN / (0.5 * diameter * kSkinModulus), 1.0,
                  pixel > 0.1 ? 0.015 : 0.005)
          << pixel << " " << diameter;
      EXPECT_NEAR(solution.area_mm2 / (0.25 * pi * diameter * diameter), 1.0, 0.005);
    }
  }
}

TEST(RigidContact, AConeIsSneddons) {
  for (const double angle : {120.0, 150.0}) {
    const double slope = 1.0 / std::tan(0.5 * angle * pi / 180.0);
    RigidContact solver = contact(cone_height(20.0, angle, 0.0), 0.05, 61, 61);
    const double depth = 0.6 * slope;
    EXPECT_NEAR(
        solver.press(depth, kFine).force_mN / (2.0 * kSkinModulus * depth * depth / (pi * slope)),
        1.0, 0.005);
  }
}

/// Of the middle row: force per length and half width of the contact.
struct Line {
  double force_mN_per_mm = 0.0;
  double half_width_mm = 0.0;
  double peak_kPa = 0.0;
};
Line middle_of(const RigidContact& solver) {
  const PixelGrid& grid = solver.grid();
  Line line;
  for (std::size_t x = 0; x < grid.columns; ++x) {
    const double p = solver.pressure_kPa()[grid.rows / 2 * grid.columns + x];
    line.force_mN_per_mm += p * grid.pixel_mm;
    line.half_width_mm += p > 0.0 ? 0.5 * grid.pixel_mm : 0.0;
    line.peak_kPa = std::max(line.peak_kPa, p);
  }
  return line;
}

TEST(RigidContact, TheMiddleOfALongCylinderOrWedgeIsPlane) {
  // Johnson, Eq. 4.43, 4.45 and 5.13: b² = 4P'R/(πE*), p0 = 2P'/(πb); P' = E*·b·slope.
  RigidContact cylinder = contact(cylinder_height(3.0, 40.0), 0.08, 33, 501);
  EXPECT_TRUE(cylinder.press(0.3, kFine).converged);
  const Line round = middle_of(cylinder);
  const double b = std::sqrt(4.0 * round.force_mN_per_mm * 3.0 / (pi * kSkinModulus));
  EXPECT_NEAR(round.half_width_mm, b, 0.08);
  EXPECT_NEAR(round.peak_kPa / (2.0 * round.force_mN_per_mm / (pi * b)), 1.0, 0.01);

  RigidContact wedge = contact(wedge_height(20.0, 40.0, 150.0, 0.0), 0.08, 41, 501);
  EXPECT_TRUE(wedge.press(0.5, kFine).converged);
  const Line sharp = middle_of(wedge);
  const double slope = 1.0 / std::tan(75.0 * pi / 180.0);
  EXPECT_NEAR(sharp.half_width_mm, sharp.force_mN_per_mm / (kSkinModulus * slope), 0.06);
}

TEST(RigidContact, OnABondedLayerItIsTheFredholmSolution) {
  const SkinParameters skin{.thickness_mm = 4.0};
  const reference::BondedLayer exact(skin.poisson_ratio);
  for (const double depth : {0.3, 1.5}) {
    RigidContact solver = contact(sphere_height(5.0), 0.1, 75, 75, LayeredMedium(skin));
    const double hertz = 4.0 / 3.0 * kSkinModulus * std::sqrt(5.0) * std::pow(depth, 1.5);
    const double chi = std::sqrt(5.0 * depth) / skin.thickness_mm;
    EXPECT_NEAR(solver.press(depth, kFine).force_mN / (hertz * exact.force_factor(chi)), 1.0, 0.005)
        << depth;
  }
}

TEST(RigidContact, ForceAndDepthGiveTheSamePress) {
  const TipHeight dots = dots_height({{-1.0, 0.0}, {1.0, 0.4}}, 0.8, 0.1);
  const TipHeight gap = above_finger(dots, 14.0, 7.0, {});
  RigidContact solver = contact(gap, 0.08, 41, 21);
  const RigidContact::Solution by_depth = solver.press(0.7, kFine);
  solver.reset();
  const RigidContact::Solution by_force = press_with_force(solver, by_depth.force_mN);
  EXPECT_TRUE(by_force.converged);
  EXPECT_NEAR(by_force.depth_mm, 0.7, 1e-3);
  EXPECT_NEAR(by_force.peak_pressure_kPa / by_depth.peak_pressure_kPa, 1.0, 0.01);
}

TEST(RigidContact, AWarmStartNeedsFewerIterationsAndGivesTheSame) {
  RigidContact cold = contact(sphere_height(5.0), 0.1, 61, 61);
  RigidContact warm = contact(sphere_height(5.0), 0.1, 61, 61);
  EXPECT_TRUE(warm.press(1.0, kFine).converged);
  const RigidContact::Solution a = cold.press(1.005, kFine);
  const RigidContact::Solution b = warm.press(1.005, kFine);
  EXPECT_LT(b.iterations, a.iterations);
  EXPECT_NEAR(a.force_mN / b.force_mN, 1.0, 1e-4);
}

TEST(RigidContact, ContactThatSplitsAndMergesConverges) {
  // Two cones under a slope that decides which touches first.
  const TipHeight cone = cone_height(20.0, 140.0, 0.05);
  for (const double tilt : {-8.0, 0.0, 8.0}) {
    const TipHeight twins =
        turned([=](double x, double y) { return std::min(cone(x - 1.0, y), cone(x + 1.0, y)); },
               0.0, tilt);
    RigidContact solver = contact(twins, 0.08, 61, 41);
    for (const double depth : {0.05, 0.6, 1.2, 0.3, 0.05}) {
      EXPECT_TRUE(solver.press(depth, kFine).converged) << tilt << " " << depth;
    }
  }
}

TEST(RigidContact, NothingTouchesWithoutADepthOrATip) {
  RigidContact solver = contact(sphere_height(5.0), 0.1, 31, 31);
  EXPECT_EQ(solver.press(0.0, kFine).force_mN, 0.0);
  EXPECT_EQ(solver.press(-1.0, kFine).force_mN, 0.0);
  EXPECT_EQ(press_with_force(solver, 0.0).depth_mm, 0.0);
  RigidContact nothing = contact([](double, double) { return kStraight; }, 0.1, 9, 9);
  EXPECT_EQ(nothing.press(1.0, kFine).force_mN, 0.0);
  EXPECT_EQ(press_with_force(nothing, 1.0).force_mN, 0.0);
}

}  // namespace
}  // namespace merkel
