#include "core/contact/sliding_contact.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/pressed_tip.hpp"
#include "core/contact/sphere_law.hpp"
#include "tests/core/contact/energy_of_stress.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr Position kApex{15.0, 10.0};

SkinParameters finger(double along_mm = 14.0) {
  return {.radius_mm = 7.0, .radius_along_mm = along_mm, .apex = kApex};
}

Indenter plate() { return {.tip = SphereTip{kUnbounded}, .surface = {.slides = true}}; }

/// Dots of 1 mm with rounded rims, 3.2 mm apart, raised by 0.5 mm.
Indenter dots() {
  return {.tip = DotsTip{.centres = {{0.0, 0.0}}, .diameter_mm = 1.0, .edge_radius_mm = 0.2},
          .surface = {.slides = true, .relief_mm = 0.5, .period_x_mm = 3.2, .period_y_mm = 3.2}};
}

/// One dot without a base.
Indenter dot(double edge_radius_mm) {
  Indenter one = dots();
  std::get<DotsTip>(one.tip).edge_radius_mm = edge_radius_mm;
  one.surface = {.slides = true};
  return one;
}

SlidingContact sliding(const Indenter& surface, const SkinParameters& skin) {
  return {surface, skin, milliseconds(1), 0.0};
}

ContactInput at_apex(double depth_mm, double x_mm = 0.0, double y_mm = 0.0) {
  return {.depth_mm = depth_mm, .x_mm = kApex.x_mm + x_mm, .y_mm = kApex.y_mm + y_mm};
}

/// The contact of the same surface, solved once on fine pixels.
struct Reference {
  PressTables press;
  Reference(const Indenter& surface, const SkinParameters& skin, double depth_mm,
            const Position& apex) {
    const TipHeight tip =
        above_finger(height_of(surface, skin), skin.radius_along_mm, skin.radius_mm, apex);
    // A press by the depth counts from the lowest point of the gap.
    const double sag = 0.5 * apex.x_mm * apex.x_mm / skin.radius_along_mm +
                       0.5 * apex.y_mm * apex.y_mm / skin.radius_mm;
    double lowest = kUnbounded;
    for (double y = -0.6; y <= 0.6; y += 0.005) {
      for (double x = -0.6; x <= 0.6; x += 0.005) lowest = std::min(lowest, tip(x, y));
    }
    press = press_tables({.gap = [=](double x, double y) { return tip(x, y) - lowest; },
                          .half_width_mm = 0.55,
                          .half_length_mm = 0.55,
                          .feature_mm = 0.5,
                          .deepest_mm = depth_mm - lowest - sag,
                          .proportional = true},
                         LayeredMedium(skin), skin.receptor_depth_mm);
  }
  [[nodiscard]] double force_mN() const {
    return press.tables.back().force_mN_per_mm * press.tables.back().depth_mm;
  }
  /// The stress at the node nearest to a point, and where that node is.
  [[nodiscard]] CartesianStress stress(double& x_mm, double& y_mm) const {
    const auto nearest = [&](double at, std::size_t count) {
      return static_cast<std::size_t>(
          std::lround(at / press.grid.pixel_mm + 0.5 * static_cast<double>(count - 1)));
    };
    const std::size_t i = nearest(x_mm, press.grid.columns);
    const std::size_t j = nearest(y_mm, press.grid.rows);
    x_mm = press.grid.x_mm(i);
    y_mm = press.grid.y_mm(j);
    return press.tables.back().nodes[j * press.grid.columns + i].stress() *
           press.tables.back().depth_mm;
  }
};

TEST(SlidingContact, APlateOnARoundFingerIsHertz) {
  const SkinParameters skin = finger(7.0);
  SlidingContact contact = sliding(plate(), skin);
  const SphereLaw hertz(skin, kUnbounded);
  for (const double depth : {0.3, 0.6, 1.2}) {
    contact.settle(at_apex(depth, 3.3, -1.7));
    const ContactState exact = hertz.at_depth(depth);
    EXPECT_NEAR(contact.press().contact.force_mN / exact.force_mN, 1.0, 0.005) << depth;
    EXPECT_EQ(contact.press().x_mm, kApex.x_mm);
    const double middle =
        energy_density_kPa(huber_stress(exact, skin.poisson_ratio, 0.0, skin.receptor_depth_mm),
                           SkinMaterial(skin), skin.energy_density);
    double largest = 0.0;
    for (double r = 0.0; r < 6.0; r += 0.23) {
      const double wanted =
          energy_density_kPa(huber_stress(exact, skin.poisson_ratio, r, skin.receptor_depth_mm),
                             SkinMaterial(skin), skin.energy_density);
      largest = std::max(
          {largest, std::fabs(energy(contact.at(r, 0.0).stress, skin) - wanted) / middle,
           std::fabs(energy(contact.at(-0.6 * r, 0.8 * r).stress, skin) - wanted) / middle});
    }
    EXPECT_LT(largest, 0.01) << depth;
  }
}

TEST(SlidingPlan, FinerTicksHaveTheSameLag) {
  for (const int tick_us : {1000, 500, 250}) {
    const auto plan = SlidingPlan::of(dots(), finger(), std::chrono::microseconds(tick_us));
    ASSERT_TRUE(plan);
    EXPECT_EQ(plan->latency() * tick_us, 8000) << tick_us;
    EXPECT_GE(plan->ticks * plan->parts_per_tick, SlidingPlan::kParts) << tick_us;
  }
}

TEST(SlidingContact, UnderAForceItFindsTheDepth) {
  const SkinParameters skin = finger(7.0);
  Indenter surface = plate();
  surface.control = Indenter::Control::kForce;
  SlidingContact contact = sliding(surface, skin);
  contact.settle({.force_mN = 400.0});
  EXPECT_NEAR(contact.press().contact.force_mN, 400.0, 1e-6);
  EXPECT_NEAR(contact.press().contact.depth_mm,
              SphereLaw(skin, kUnbounded).at_force(400.0).depth_mm, 0.005);
}

TEST(SlidingContact, UnderAForceTheSkinStiffens) {
  for (const bool with_depth : {true, false}) {
    SkinParameters skin = finger(7.0);
    (with_depth ? skin.stiffening_mm : skin.stiffening_kPa) = with_depth ? 1.5 : 30.0;
    Indenter surface = plate();
    surface.control = Indenter::Control::kForce;
    SlidingContact contact = sliding(surface, skin);
    contact.settle({.force_mN = 400.0});
    const ContactState plate = SphereLaw(skin, kUnbounded).at_force(400.0);
    EXPECT_NEAR(contact.press().contact.force_mN, 400.0, with_depth ? 0.5 : 4.0);
    // The mean pressure is that of whole pixels in contact.
    EXPECT_NEAR(contact.press().contact.depth_mm, plate.depth_mm,
                with_depth ? 0.005 : 0.015 * plate.depth_mm);
    EXPECT_NEAR(contact.press().contact.stiffening / plate.stiffening, 1.0, 0.02) << with_depth;
  }
}

/// The largest difference of the energy density, relative to the largest one.
double energy_error(const SlidingContact& contact, const Reference& fixed, const Position& offset,
                    const SkinParameters& skin) {
  double largest = 0.0;
  double error = 0.0;
  for (double y = -1.5; y <= 1.5; y += 0.3) {
    for (double x = -1.5; x <= 1.5; x += 0.3) {
      double at_x = x;
      double at_y = y;
      const double wanted = energy(fixed.stress(at_x, at_y), skin);
      const double found = energy(contact.at(at_x - offset.x_mm, at_y - offset.y_mm).stress, skin);
      largest = std::max(largest, wanted);
      error = std::max(error, std::fabs(found - wanted));
    }
  }
  return error / largest;
}

// Six pixels across.
TEST(SlidingContact, ADotIsTheFixedTipAtTheSameOffset) {
  const SkinParameters skin = finger();
  const double depth = 0.8;
  for (const Position offset : {Position{0.0, 0.0}, Position{1.13, 0.0}, Position{-0.7, 1.9}}) {
    SlidingContact sharp = sliding(dot(0.0), skin);
    // The middle of the dot is at -offset from the apex.
    sharp.settle(at_apex(depth, -offset.x_mm, -offset.y_mm));
    const Reference fixed(dot(0.0), skin, depth, offset);
    EXPECT_NEAR(sharp.press().contact.force_mN / fixed.force_mN(), 1.0, 0.005);
    EXPECT_LT(energy_error(sharp, fixed, offset, skin), 0.03);
    EXPECT_NEAR(sharp.energy_kPa(0.3, 0.2), energy(sharp.at(0.3, 0.2).stress, skin), 1e-12);
    EXPECT_NEAR(sharp.energy_kPa(9.03, 0.2) / energy(sharp.at(9.03, 0.2).stress, skin), 1.0, 2e-3);

    const Reference rounded(dot(0.2), skin, depth, offset);
    Indenter by_force = dot(0.2);
    by_force.control = Indenter::Control::kForce;
    SlidingContact pressed = sliding(by_force, skin);
    ContactInput input = at_apex(0.0, -offset.x_mm, -offset.y_mm);
    input.force_mN = rounded.force_mN();
    pressed.settle(input);
    EXPECT_LT(energy_error(pressed, rounded, offset, skin), 0.035);
    SlidingContact deep = sliding(dot(0.2), skin);
    deep.settle(at_apex(depth, -offset.x_mm, -offset.y_mm));
    EXPECT_LT(energy_error(deep, rounded, offset, skin), 0.032);
    EXPECT_NEAR(deep.press().contact.force_mN / rounded.force_mN(), 1.0, 0.005);
  }
}

TEST(SlidingContact, WhileItSlidesItIsTheContactAtRestOneLatencyAgo) {
  const SkinParameters skin = finger();
  SlidingContact moving = sliding(dots(), skin);
  SlidingContact still = sliding(dots(), skin);
  const double depth = 0.8;
  const double speed_mm_per_tick = 0.04;
  const auto place = [&](int tick) { return at_apex(depth, speed_mm_per_tick * tick, 0.3); };
  int tick = 0;
  for (; tick < 120; ++tick) {
    moving.take(place(tick));
    moving.work();
  }
  double largest = 0.0;
  double error = 0.0;
  double force_error = 0.0;
  for (int probe = 0; probe < 12; ++probe) {
    for (int k = 0; k < 9; ++k, ++tick) {
      moving.take(place(tick));
      moving.work();
    }
    still.settle(place(tick - 1 - moving.plan().latency()));
    force_error =
        std::max(force_error,
                 std::fabs(moving.press().contact.force_mN / still.press().contact.force_mN - 1.0));
    for (double x = -4.0; x <= 4.0; x += 0.31) {
      const double wanted = energy(still.at(x, 0.2).stress, skin);
      largest = std::max(largest, wanted);
      error = std::max(error, std::fabs(energy(moving.at(x, 0.2).stress, skin) - wanted));
    }
  }
  EXPECT_LT(force_error, 0.005);
  EXPECT_LT(error, 0.01 * largest);
  EXPECT_EQ(moving.report().cut_off, 0U);
  EXPECT_LT(static_cast<double>(moving.report().poor),
            0.1 * static_cast<double>(moving.report().solutions));
  EXPECT_GE(1000 / moving.plan().ticks, 250);
}

TEST(SlidingContact, ItsMovementTellsTheErrorOfFastSlides) {
  const SkinParameters skin = finger();
  for (const double speed_mm_per_tick : {0.16, 0.32}) {
    SlidingContact moving = sliding(dots(), skin);
    SlidingContact still = sliding(dots(), skin);
    const auto place = [&](int tick) { return at_apex(0.8, speed_mm_per_tick * tick, 0.3); };
    double largest = 0.0;
    double error = 0.0;
    for (int tick = 0; tick < 60; ++tick) {
      moving.take(place(tick));
      moving.work();
      if (tick < 24 || tick % 5 != 0) continue;
      still.settle(place(tick - moving.plan().latency()));
      for (double x = -4.0; x <= 4.0; x += 0.31) {
        const double wanted = energy(still.at(x, 0.2).stress, skin);
        largest = std::max(largest, wanted);
        error = std::max(error, std::fabs(energy(moving.at(x, 0.2).stress, skin) - wanted));
      }
    }
    EXPECT_NEAR(moving.report().farthest_mm, speed_mm_per_tick * moving.plan().ticks, 1e-9);
    EXPECT_LT(error / largest, 1.2 * moving.movement_error()) << speed_mm_per_tick;
    EXPECT_GT(error / largest, 0.3 * moving.movement_error()) << speed_mm_per_tick;
  }
}

TEST(SlidingContact, RepeatsAfterAPeriod) {
  const SkinParameters skin = finger();
  SlidingContact here = sliding(dots(), skin);
  SlidingContact there = sliding(dots(), skin);
  here.settle(at_apex(0.7, 0.4, 0.9));
  there.settle(at_apex(0.7, 0.4 + 2 * 3.2, 0.9 - 3.2));
  EXPECT_NEAR(there.press().contact.force_mN / here.press().contact.force_mN, 1.0, 1e-9);
  EXPECT_NEAR(there.at(1.0, 0.3).stress.sigma_z, here.at(1.0, 0.3).stress.sigma_z, 1e-4);
}

TEST(SlidingContact, StartsAnewAfterAReset) {
  const SkinParameters skin = finger();
  SlidingContact contact = sliding(dots(), skin);
  std::vector<double> forces[2];
  for (auto& run : forces) {
    contact.reset();
    for (int k = 0; k < 60; ++k) {
      contact.take(at_apex(0.02 * std::min(k, 40), 0.05 * k));
      contact.work();
      run.push_back(contact.press().contact.force_mN);
    }
  }
  EXPECT_EQ(forces[0], forces[1]);
  EXPECT_GT(forces[0].back(), 0.0);
}

TEST(SlidingContact, ReportsWhatItCannotSolve) {
  const SkinParameters skin = finger();
  SlidingContact deep = sliding(plate(), skin);
  deep.settle(at_apex(2.5));
  EXPECT_GT(deep.report().cut_off, 0U);
  SlidingContact beyond = sliding(dot(0.0), skin);
  beyond.settle(at_apex(0.8, 1.0));
  EXPECT_GT(beyond.report().off_surface, 0U);
}

}  // namespace
}  // namespace merkel
