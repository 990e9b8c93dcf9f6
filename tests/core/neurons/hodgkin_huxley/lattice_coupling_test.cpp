#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"

namespace merkel {
namespace {

TEST(LatticeCoupling, FingertipHas31Edges) {
  const auto network = LatticeCoupling::create({}, 5, 4);
  ASSERT_TRUE(network);
  EXPECT_EQ(network->edges(), 31U);
  std::size_t weights = 0;
  for (std::size_t n = 0; n < 20; ++n) {
    for (const double g : {network->to_next_column()[n], network->to_next_row()[n]}) {
      if (g == 0.0) continue;
      ++weights;
      EXPECT_GE(g, 0.1 * 0.1);
      EXPECT_LT(g, 0.1 * 0.3);
    }
  }
  EXPECT_EQ(weights, 31U);
}

TEST(LatticeCoupling, NeighboursAcrossTheRowBorderAreNotCoupled) {
  const auto network = LatticeCoupling::create({}, 5, 4);
  for (const std::size_t last_of_row : {4U, 9U, 14U, 19U}) {
    EXPECT_EQ(network->to_next_column()[last_of_row], 0.0);
  }
}

TEST(LatticeCoupling, ExchangedCurrentsSumToZero) {
  const auto network = LatticeCoupling::create({.gain = 3.0}, 7, 6);
  Random random(5);
  std::vector<double> V(42);
  for (double& v : V) v = random.uniform(-90.0, 40.0);
  double sum = 0.0;
  double magnitude = 0.0;
  for (std::size_t n = 0; n < V.size(); ++n) {
    const double current = network->inflow(V, n) - network->conductance()[n] * V[n];
    sum += current;
    magnitude += std::fabs(current);
  }
  EXPECT_NEAR(sum / magnitude, 0.0, 1e-14);
}

TEST(LatticeCoupling, EqualPotentialsExchangeNothing) {
  const auto network = LatticeCoupling::create({}, 5, 4);
  const std::vector<double> V(20, -65.0);
  for (std::size_t n = 0; n < 20; ++n) {
    EXPECT_NEAR(network->inflow(V, n) - network->conductance()[n] * V[n], 0.0, 1e-14);
  }
}

TEST(LatticeCoupling, RefusesWeightsOutOfOrder) {
  EXPECT_EQ(LatticeCoupling::create({.weight_min = 0.4}, 5, 4).error().key, "network.weight_min");
  EXPECT_EQ(LatticeCoupling::create({.gain = -1.0}, 5, 4).error().key, "network.gain");
}

}  // namespace
}  // namespace merkel
