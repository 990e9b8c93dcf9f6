#include "core/receptors/receptor_placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using Placement = ReceptorParameters::Placement;

std::array<double, 5> count_by_column(const std::vector<Receptor>& receptors) {
  std::array<double, 5> counts{};
  for (const Receptor& receptor : receptors) ++counts[(receptor.neuron - 1) % 5];
  return counts;
}

// Expected receptors in each of the four subregions of a column.
constexpr std::array<double, 5> kExpected = {37.50, 31.17, 21.90, 13.63, 8.30};

TEST(ReceptorPlacement, LatticeHasTheExpectedCountsByColumn) {
  const auto receptors = place_receptors({.placement = Placement::kLattice}, Patch{});
  ASSERT_TRUE(receptors);
  ASSERT_EQ(receptors->size(), 450U);
  const auto counts = count_by_column(*receptors);
  // The lattice rounds each border to a whole receptor.
  for (std::size_t c = 0; c < 5; ++c) EXPECT_NEAR(counts[c] / 4.0, kExpected[c], 0.25);
}

TEST(ReceptorPlacement, RandomHasTheExpectedCountsByColumnOnAverage) {
  std::array<double, 5> sum{};
  constexpr int kSeeds = 400;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const auto receptors = place_receptors({.seed = static_cast<std::uint64_t>(seed)}, Patch{});
    ASSERT_TRUE(receptors);
    const auto counts = count_by_column(*receptors);
    for (std::size_t c = 0; c < 5; ++c) sum[c] += counts[c] / 4.0;
  }
  // Five standard errors of a multinomial count of 450 draws, 400 times.
  for (std::size_t c = 0; c < 5; ++c) {
    const double p = 4.0 * kExpected[c] / 450.0;
    const double error = std::sqrt(450.0 * p * (1.0 - p) / kSeeds) / 4.0;
    EXPECT_NEAR(sum[c] / kSeeds, kExpected[c], 5.0 * error + 0.005);
  }
}

/// The largest distance between the empirical distribution of the values and F.
template <class Distribution>
double kolmogorov_smirnov(std::vector<double> values, Distribution F) {
  std::sort(values.begin(), values.end());
  const auto count = static_cast<double>(values.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double f = F(values[i]);
    largest = std::max(
        {largest, f - static_cast<double>(i) / count, static_cast<double>(i + 1) / count - f});
  }
  return largest;
}

// Kolmogorov-Smirnov at the 5 % level (1.358/√n): about one draw in twenty exceeds it.
TEST(ReceptorPlacement, FollowsTheDensityAlongTheFingerAndIsEvenAcross) {
  const auto density = ReceptorDensity::create({});
  const double all = density->cumulative_per_mm(30.0);
  const double critical = 1.358 / std::sqrt(450.0);
  int exceeded_x = 0;
  int exceeded_y = 0;
  constexpr int kSeeds = 400;
  for (int seed = 0; seed < kSeeds; ++seed) {
    std::vector<double> x;
    std::vector<double> y;
    const auto receptors = place_receptors({.seed = static_cast<std::uint64_t>(seed)}, {});
    for (const Receptor& r : *receptors) {
      x.push_back(r.x_mm);
      y.push_back(r.y_mm);
    }
    const auto along = [&](double v) { return density->cumulative_per_mm(v) / all; };
    exceeded_x += kolmogorov_smirnov(x, along) > critical ? 1 : 0;
    exceeded_y += kolmogorov_smirnov(y, [](double v) { return v / 20.0; }) > critical ? 1 : 0;
  }
  // Binomial(400, 0.05): 20 ± 5 standard deviations of 4.4.
  EXPECT_LE(exceeded_x, 42);
  EXPECT_LE(exceeded_y, 42);
  EXPECT_GE(exceeded_x, 1);
}

// Fails if a compiler, a library or a machine gives different bits.
TEST(ReceptorPlacement, SameSeedGivesTheSameBitsEverywhere) {
  const auto receptors = place_receptors({.seed = 1}, Patch{});
  ASSERT_TRUE(receptors);
  EXPECT_EQ((*receptors)[0].x_mm, 0x1.5d8b4dfaae47bp+3);
  EXPECT_EQ((*receptors)[0].y_mm, 0x1.dd4ce2137de54p+3);
  EXPECT_EQ((*receptors)[449].x_mm, 0x1.3ab378baf5af2p+3);
  EXPECT_EQ((*receptors)[449].y_mm, 0x1.5d0ed989c8699p+3);
}

TEST(ReceptorPlacement, SeedsDiffer) {
  const auto one = place_receptors({.seed = 1}, Patch{});
  const auto two = place_receptors({.seed = 2}, Patch{});
  EXPECT_NE((*one)[0].x_mm, (*two)[0].x_mm);
}

TEST(ReceptorPlacement, AllReceptorsLieOnThePatchInTheirSubregion) {
  const Patch patch{.length_mm = 12.0, .width_mm = 9.0, .columns = 3, .rows = 2};
  for (const auto placement : {Placement::kRandom, Placement::kLattice}) {
    const auto receptors = place_receptors({.placement = placement, .count = 1000}, patch);
    ASSERT_TRUE(receptors);
    EXPECT_EQ(receptors->size(), 1000U);
    EXPECT_TRUE(std::all_of(receptors->begin(), receptors->end(), [&](const Receptor& r) {
      return patch.contains(r.x_mm, r.y_mm) && patch.neuron_at(r.x_mm, r.y_mm) == r.neuron;
    }));
  }
}

TEST(ReceptorPlacement, RefusesMoreReceptorsThanItCanHold) {
  EXPECT_EQ(place_receptors({.count = -1}, Patch{}).error().key, "receptors.count");
  EXPECT_EQ(
      place_receptors({.density_per_mm2 = 1e9, .density_max_per_mm2 = 2e9}, Patch{}).error().key,
      "receptors.density_per_mm2");
}

// Middles of equal shares along, the golden-ratio sequence across.
TEST(ReceptorPlacement, AnEvenLatticeHasItsClosedForm) {
  const Patch patch;
  const auto receptors = place_receptors({.placement = Placement::kLattice,
                                          .count = 4,
                                          .density_per_mm2 = 1.0,
                                          .density_max_per_mm2 = 1.001,
                                          .density_min_per_mm2 = 0.999},
                                         patch);
  ASSERT_TRUE(receptors) << receptors.error().reason;
  const double across[] = {0.5, 0.118033988749895, 0.736067977499790, 0.354101966249685};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR((*receptors)[k].x_mm, patch.length_mm * (static_cast<double>(k) + 0.5) / 4.0, 0.05);
    EXPECT_NEAR((*receptors)[k].y_mm, patch.width_mm * across[k], 1e-12);
  }
}

}  // namespace
}  // namespace merkel
