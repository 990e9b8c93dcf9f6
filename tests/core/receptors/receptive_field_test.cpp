#include "core/receptors/receptive_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/scene/patch_layout.hpp"

namespace merkel {
namespace {

/// The receptors of fields whose centres follow the density law.
Expected<std::vector<Receptor>, ParameterError> place_fields(const ReceptiveField& field,
                                                             const ReceptorParameters& placement,
                                                             const Patch& patch) {
  const auto layout = layout_of(
      {.patch = patch, .receptors = placement, .layout = ReceptorLayout::kFields, .field = field});
  if (!layout) return Unexpected<ParameterError>(layout.error());
  return layout->receptors;
}

TEST(ReceptiveField, IsAVogelSpiral) {
  const auto receptors =
      place_fields(ReceptiveField{}, {{15.0, 10.0}, {3.0, 4.0}}, {1.0, 1.0}, Patch{});
  ASSERT_TRUE(receptors);
  ASSERT_EQ(receptors->size(), 56U);
  for (std::size_t k = 0; k < 56; ++k) {
    const auto turn = static_cast<double>(k % 28);
    const double r = std::sqrt((turn + 0.5) / 28.0);
    const double angle = turn * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const Receptor& receptor = (*receptors)[k];
    EXPECT_NEAR(receptor.x_mm, (k < 28 ? 15.0 : 3.0) + r * std::cos(angle), 1e-13);
    EXPECT_NEAR(receptor.y_mm, (k < 28 ? 10.0 : 4.0) + r * std::sin(angle), 1e-13);
    EXPECT_EQ(receptor.neuron, k < 28 ? 1U : 2U);
  }
}

TEST(ReceptiveField, IsDenseInTheMiddleIfConcentrated) {
  for (const double q : {0.25, 0.5, 0.75, 1.0, 1.25, 2.5}) {
    const auto receptors =
        place_fields(ReceptiveField{.concentration = q}, {{15.0, 10.0}}, {1.4}, Patch{});
    ASSERT_TRUE(receptors);
    for (std::size_t k = 0; k < 28; ++k) {
      const Receptor& receptor = (*receptors)[k];
      EXPECT_NEAR(std::hypot(receptor.x_mm - 15.0, receptor.y_mm - 10.0),
                  1.4 * std::pow((static_cast<double>(k) + 0.5) / 28.0, q), 1e-13)
          << q;
    }
  }
  const auto wrong = ReceptiveField{.concentration = 0.6}.check(Patch{});
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().key, "receptors.field_concentration");
}

TEST(ReceptiveField, AfferentsFollowTheDensityLaw) {
  for (const auto placement :
       {ReceptorParameters::Placement::kRandom, ReceptorParameters::Placement::kLattice}) {
    const ReceptorParameters afferents{.placement = placement, .seed = 4};
    const auto receptors = place_fields(ReceptiveField{}, afferents, Patch{});
    const auto centres = place_receptors(afferents, Patch{});
    ASSERT_TRUE(receptors && centres);
    ASSERT_EQ(centres->size(), 450U);
    ASSERT_EQ(receptors->size(), 12'600U);
    for (std::size_t n = 0; n < 450; ++n) {
      double x = 0.0;
      for (std::size_t k = 0; k < 28; ++k) {
        const Receptor& receptor = (*receptors)[28 * n + k];
        EXPECT_EQ(receptor.neuron, n + 1);
        x += receptor.x_mm / 28.0;
        EXPECT_LE(
            std::hypot(receptor.x_mm - (*centres)[n].x_mm, receptor.y_mm - (*centres)[n].y_mm),
            1.0);
      }
      EXPECT_NEAR(x, (*centres)[n].x_mm, 0.05);
    }
  }
}

// Recorded fields of single afferents differ: ln(radius) has the wanted spread, and the receptors
// of each afferent fill its own disc.
TEST(ReceptiveField, RadiiMayDifferBetweenAfferents) {
  const PatchParameters patch{.layout = ReceptorLayout::kFields, .field = {.radius_spread = 0.4}};
  const auto layout = layout_of(patch);
  ASSERT_TRUE(layout);
  double sum = 0.0;
  double sum2 = 0.0;
  for (std::size_t n = 0; n < 450; ++n) {
    const AfferentSite& site = layout->afferents[n];
    double farthest = 0.0;
    for (std::size_t k = 0; k < 28; ++k) {
      const Receptor& receptor = layout->receptors[28 * n + k];
      farthest =
          std::max(farthest, std::hypot(receptor.x_mm - site.x_mm, receptor.y_mm - site.y_mm));
    }
    EXPECT_NEAR(farthest, site.radius_mm * std::sqrt(27.5 / 28.0), 1e-12);
    sum += std::log(site.radius_mm) / 450.0;
    sum2 += std::log(site.radius_mm) * std::log(site.radius_mm) / 450.0;
  }
  EXPECT_NEAR(sum, 0.0, 0.06);
  EXPECT_NEAR(std::sqrt(sum2 - sum * sum), 0.4, 0.04);
  PatchParameters other = patch;
  other.receptors.seed = 2;
  EXPECT_NE(layout_of(other)->afferents[0].radius_mm, layout->afferents[0].radius_mm);
}

TEST(ReceptiveField, RefusesInvalidValues) {
  EXPECT_EQ(place_fields({.receptors = 0}, ReceptorParameters{}, Patch{}).error().key,
            "receptors.field_receptors");
  EXPECT_EQ(place_fields({.radius_mm = 10.5}, ReceptorParameters{}, Patch{}).error().key,
            "receptors.field_radius_mm");
  EXPECT_EQ(place_fields({}, {{31.0, 5.0}}, {1.0}, Patch{}).error().key, "receptors.centres_mm");
  EXPECT_EQ(
      place_fields({.receptors = 10'000}, ReceptorParameters{.count = 2000}, Patch{}).error().key,
      "receptors.count");
}

}  // namespace
}  // namespace merkel
