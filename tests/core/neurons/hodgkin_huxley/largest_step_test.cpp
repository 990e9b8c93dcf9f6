#include "core/neurons/hodgkin_huxley/largest_step.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

using Method = IntegrationMethod;

// The network of `paper` exchanges 20/ms at a gain of 23 mS/cm², 1/ms at 1.16 mS/cm².
TEST(LargestStep, FallsWithTheExchangeBetweenNeurons) {
  const auto of = [](Method method, double exchange_per_ms) {
    return largest_step_ms(method, largest_step_alone_ms({}, method), exchange_per_ms);
  };
  EXPECT_NEAR(of(Method::kCrankNicolson, 20.0), 0.025, 1e-12);
  EXPECT_NEAR(of(Method::kStaggeredMultistep, 1.0), 0.05, 1e-12);
  EXPECT_NEAR(of(Method::kRk4, 0.0), 0.08, 1e-12);
}

TEST(LargestStep, MeasuredOfAlmostThePublishedNeuronIsThePublishedOne) {
  const HodgkinHuxley almost{.g_L = 0.3000001};
  for (std::size_t i = 0; i < integration_method_names().size(); ++i) {
    const auto method = static_cast<Method>(i);
    EXPECT_EQ(largest_step_alone_ms(almost, method), largest_step_alone_ms({}, method))
        << name_of(method);
  }
}

// Explicit methods diverge where the leak, or the sodium of a spike, is faster than a step.
TEST(LargestStep, FallsWithTheSpeedOfTheMembrane) {
  const auto us = [](const HodgkinHuxley& neuron, Method method) {
    return 1e3 * largest_step_alone_ms(neuron, method);
  };
  const HodgkinHuxley leaky{.g_L = 100.0};
  for (const Method method : {Method::kForwardEuler, Method::kHeun, Method::kRk4}) {
    const double interval = method == Method::kRk4 ? 2.785 : 2.0;
    EXPECT_LT(us(leaky, method), 1e3 * interval / leaky.g_L) << name_of(method);
    EXPECT_GT(us(leaky, method), 0.6e3 * interval / leaky.g_L) << name_of(method);
  }
  EXPECT_EQ(us(leaky, Method::kCrankNicolson), 125.0);
  EXPECT_LT(us({.g_Na = 1000.0}, Method::kHeun), 8.0);
  EXPECT_LT(us({.capacitance_uF_per_cm2 = 0.2}, Method::kStaggeredMultistep), 20.0);
  EXPECT_EQ(us({.E_K = -500.0}, Method::kForwardEuler), 0.0);
}

}  // namespace
}  // namespace merkel
