#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(HodgkinHuxley, LeakReversalMakesTheRestAFixedPoint) {
  const HodgkinHuxley neuron;
  EXPECT_NEAR(neuron.leak_reversal_mV(), -56.3469184654, 5e-11);
  const auto rest = neuron.channels(neuron.steady_gates(-65.0), neuron.leak_reversal_mV());
  EXPECT_NEAR(rest.driven - rest.conductance * -65.0, 0.0, 1e-13);
}

TEST(HodgkinHuxley, WithoutCalciumItIsTheClassicNeuron) {
  EXPECT_NEAR(HodgkinHuxley{.g_CaL = 0.0}.leak_reversal_mV(), -54.387, 0.03);
}

TEST(HodgkinHuxley, RatesAreFiniteAndSmoothAtTheSingularVoltages) {
  const HodgkinHuxley neuron;
  EXPECT_EQ(neuron.rates(-55.0).alpha.n, 0.1);
  EXPECT_EQ(neuron.rates(-40.0).alpha.m, 1.0);
  for (const double offset : {1e-15, -1e-15, 1e-9, -1e-9}) {
    EXPECT_NEAR(neuron.rates(-55.0 + offset).alpha.n, 0.1, 1e-9);
    EXPECT_NEAR(neuron.rates(-40.0 + offset).alpha.m, 1.0, 1e-9);
  }
}

TEST(HodgkinHuxley, LinoidKeepsItsDigitsNearZero) {
  // x/(eˣ−1) = 1 − x/2 + x²/12 − …
  for (const double x : {1e-15, -1e-12, 1e-8, 1e-5}) {
    EXPECT_NEAR(linoid(x), 1.0 - x / 2.0 + x * x / 12.0, 2e-16);
  }
}

TEST(HodgkinHuxley, RatesMatchTheTextbook) {
  const GateRates rates = HodgkinHuxley{}.rates(-30.0);  // v = 35
  EXPECT_NEAR(rates.alpha.n, 0.01 * (10.0 - 35.0) / (std::exp(-2.5) - 1.0), 1e-14);
  EXPECT_NEAR(rates.beta.n, 0.125 * std::exp(-35.0 / 80.0), 1e-14);
  EXPECT_NEAR(rates.alpha.m, 0.1 * (25.0 - 35.0) / (std::exp(-1.0) - 1.0), 1e-14);
  EXPECT_NEAR(rates.beta.m, 4.0 * std::exp(-35.0 / 18.0), 1e-14);
  EXPECT_NEAR(rates.alpha.h, 0.07 * std::exp(-35.0 / 20.0), 1e-14);
  EXPECT_NEAR(rates.beta.h, 1.0 / (std::exp(-0.5) + 1.0), 1e-14);
}

TEST(HodgkinHuxley, RefusesInvalidParameters) {
  EXPECT_EQ((HodgkinHuxley{.g_Na = -1.0}.check().error().key), "neuron.g_Na");
  EXPECT_EQ((HodgkinHuxley{.g_L = 0.0}.check().error().key), "neuron.g_L");
  EXPECT_EQ((HodgkinHuxley{.E_K = std::numeric_limits<double>::infinity()}.check().error().key),
            "neuron.E_K");
  EXPECT_EQ((HodgkinHuxley{.spike_threshold_mV = -70.0}.check().error().key),
            "neuron.spike_threshold_mV");
}

}  // namespace
}  // namespace merkel
