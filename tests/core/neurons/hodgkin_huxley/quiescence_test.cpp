#include "core/neurons/hodgkin_huxley/quiescence.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

TEST(RestingStates, AreFixedPointsOfTheMembrane) {
  const HodgkinHuxley neuron;
  const RestingStates resting(neuron);
  EXPECT_TRUE(resting.covers(0.0));
  EXPECT_TRUE(resting.covers(5.0));
  EXPECT_FALSE(resting.covers(20.0));
  EXPECT_FALSE(resting.covers(std::nan("")));
  for (const double current : {-1.0, 0.0, 0.15, 2.0, 7.0}) {
    const auto state = resting.at(current);
    const auto membrane = neuron.channels(state.gates, neuron.leak_reversal_mV());
    EXPECT_NEAR(membrane.conductance * state.V - membrane.driven, current, 1e-4);
    EXPECT_NEAR(state.gates.h, neuron.steady_gates(state.V).h, 1e-6);
  }
}

/// The largest real part of the eigenvalues of the linearised neuron at a fixed point, 1/ms.
double growth_rate(const HodgkinHuxley& neuron, double V) {
  const double leak = neuron.leak_reversal_mV();
  const auto slope = [&](const Eigen::Vector4d& x) {
    const GateRates k = neuron.rates(x[0]);
    const auto open = neuron.channels({x[1], x[2], x[3]}, leak);
    return Eigen::Vector4d((open.driven - open.conductance * x[0]) / neuron.capacitance_uF_per_cm2,
                           k.alpha.n * (1.0 - x[1]) - k.beta.n * x[1],
                           k.alpha.m * (1.0 - x[2]) - k.beta.m * x[2],
                           k.alpha.h * (1.0 - x[3]) - k.beta.h * x[3]);
  };
  const Gates gates = neuron.steady_gates(V);
  const Eigen::Vector4d point(V, gates.n, gates.m, gates.h);
  Eigen::Matrix4d jacobian;
  for (int j = 0; j < 4; ++j) {
    const Eigen::Vector4d offset = 1e-5 * Eigen::Vector4d::Unit(j);
    jacobian.col(j) = (slope(point + offset) - slope(point - offset)) / 2e-5;
  }
  return jacobian.eigenvalues().real().maxCoeff();
}

TEST(RestingStates, EndWhereADisturbanceNoLongerDecays) {
  int bounded = 0;
  for (const double sodium : {60.0, 120.0, 180.0}) {
    for (const double potassium : {24.0, 36.0, 50.0}) {
      for (const double calcium : {0.0, 0.1, 1.0}) {
        for (const double capacitance : {0.7, 1.0, 1.5}) {
          const HodgkinHuxley neuron{.capacitance_uF_per_cm2 = capacitance,
                                     .g_Na = sodium,
                                     .g_K = potassium,
                                     .g_CaL = calcium};
          const RestingStates resting(neuron);
          if (!resting.covers(0.0)) {
            EXPECT_GT(growth_rate(neuron, neuron.V_rest), -0.01);
            continue;
          }
          const double last = resting.at(resting.highest()).V;
          EXPECT_LE(growth_rate(neuron, last), -0.01);
          // In steps of 0.1 mV: the next no longer decays, or its current is not above, or it is
          // far from any resting state.
          const auto current = [&](double V) {
            const auto open = neuron.channels(neuron.steady_gates(V), neuron.leak_reversal_mV());
            return open.conductance * V - open.driven;
          };
          const bool grows = growth_rate(neuron, last + 0.1) > -0.01;
          EXPECT_TRUE(grows || current(last + 0.1) <= current(last) || last > neuron.V_rest + 199.8)
              << last;
          bounded += grows ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(bounded, 20);
}

struct Recorded {
  std::vector<SpikeEvent> spikes;
  std::size_t blocks_skipped = 0;
};

/// A press that wanders over a grid of neurons, with pauses: most neurons are at rest most of the
/// time.
Recorded wandering_press(bool freeze, double gain) {
  constexpr int kColumns = 24;
  constexpr int kRows = 12;
  constexpr std::size_t kNeurons = kColumns * kRows;
  const auto network = LatticeCoupling::create({.gain = gain}, kColumns, kRows);
  HodgkinHuxleyGroup population({.freeze_resting = freeze}, kNeurons, *network);
  Random random(11);
  SpikeBuffer spikes(100'000);
  std::vector<double> begin(kNeurons, 0.15);
  std::vector<double> end(kNeurons, 0.15);
  Recorded run;
  for (int tick = 0; tick < 900; ++tick) {
    begin = end;
    if (tick % 150 == 0) {
      // To a new position, or off the skin.
      std::fill(end.begin(), end.end(), 0.15);
      if (tick % 300 == 0) {
        const auto place = static_cast<std::size_t>(random.uniform() * (kNeurons - 30));
        for (std::size_t i = place; i < place + 12; ++i) end[i] = random.uniform(4.0, 25.0);
      }
    }
    population.advance(begin, end, 40, tick * std::chrono::milliseconds{1}, spikes);
    run.blocks_skipped += population.resting_blocks();
  }
  spikes.sort();
  run.spikes.assign(spikes.events().begin(), spikes.events().end());
  return run;
}

TEST(Quiescence, FreezingMovesNoSpikeByMoreThanAMicrosecond) {
  for (const double gain : {0.0, 0.1}) {
    const Recorded all = wandering_press(false, gain);
    const Recorded frozen = wandering_press(true, gain);
    EXPECT_EQ(all.blocks_skipped, 0U);
    EXPECT_GT(frozen.blocks_skipped, 900U * 18 / 3);
    ASSERT_EQ(frozen.spikes.size(), all.spikes.size());
    ASSERT_GT(all.spikes.size(), 100U);
    for (std::size_t i = 0; i < all.spikes.size(); ++i) {
      EXPECT_EQ(frozen.spikes[i].neuron, all.spikes[i].neuron);
      EXPECT_LE(std::abs((frozen.spikes[i].time - all.spikes[i].time).count()), 1000);
    }
  }
}

}  // namespace
}  // namespace merkel
