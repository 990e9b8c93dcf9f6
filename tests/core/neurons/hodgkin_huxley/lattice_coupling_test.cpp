#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"

namespace merkel {
namespace {

/// κ·Σ_j w_nj·(V_j − V_n) of neuron n.
double current(const LatticeCoupling& network, const std::vector<double>& V, std::size_t n) {
  const auto column = network.to_next_column();
  const auto row = network.to_next_row();
  const std::size_t columns = network.columns();
  double inflow = 0.0;
  if (n >= 1) inflow += column[n - 1] * V[n - 1];
  if (n + 1 < V.size()) inflow += column[n] * V[n + 1];
  if (n >= columns) inflow += row[n - columns] * V[n - columns];
  if (n + columns < V.size()) inflow += row[n] * V[n + columns];
  return inflow - network.conductance()[n] * V[n];
}

TEST(LatticeCoupling, FingertipHas31Edges) {
  const auto network = LatticeCoupling::create({}, 5, 4);
  ASSERT_TRUE(network);
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
    const double exchanged = current(*network, V, n);
    sum += exchanged;
    magnitude += std::fabs(exchanged);
  }
  EXPECT_NEAR(sum / magnitude, 0.0, 1e-14);
}

TEST(LatticeCoupling, EqualPotentialsExchangeNothing) {
  const auto network = LatticeCoupling::create({}, 5, 4);
  const std::vector<double> V(20, -65.0);
  for (std::size_t n = 0; n < 20; ++n) {
    EXPECT_NEAR(current(*network, V, n), 0.0, 1e-14);
  }
}

TEST(LatticeCoupling, RefusesWeightsOutOfOrder) {
  EXPECT_EQ(LatticeCoupling::create({.weight_min = 0.4}, 5, 4).error().key, "network.weight_min");
  EXPECT_EQ(LatticeCoupling::create({.gain = -1.0}, 5, 4).error().key, "network.gain");
}

}  // namespace
}  // namespace merkel
