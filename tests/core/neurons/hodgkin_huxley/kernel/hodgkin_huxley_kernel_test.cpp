// Properties of the kernels of all methods; hodgkin_huxley_group_test.cpp tests spike times.
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/neurons/hodgkin_huxley/largest_step.hpp"
#include "core/units.hpp"
#include "tests/core/every_simd_target.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

std::vector<IntegrationMethod> all_methods() {
  std::vector<IntegrationMethod> methods;
  for (const std::string& name : integration_method_names()) {
    methods.push_back(*integration_method_named(name));
  }
  return methods;
}

/// Slopes that share no exponential but differ negligibly from the default.
HodgkinHuxley general_slopes() {
  HodgkinHuxley neuron;
  neuron.beta_n.slope_mV *= 1.0 + 1e-12;
  return neuron;
}

/// Spikes and final states.
std::vector<double> history(HodgkinHuxleyGroup& population, int ticks) {
  SpikeBuffer spikes(100'000);
  std::vector<double> begin(population.size());
  std::vector<double> end(population.size());
  Random random(3);
  for (int tick = 0; tick < ticks; ++tick) {
    begin = end;
    for (double& current : end) current = random.uniform(0.0, 30.0);
    population.advance(begin, end, 40, tick * std::chrono::milliseconds{1}, spikes);
  }
  spikes.sort();
  std::vector<double> all;
  for (const SpikeEvent& spike : spikes.events()) {
    all.push_back(static_cast<double>(spike.time.count()));
    all.push_back(spike.neuron);
  }
  EXPECT_GT(all.size(), 2U);
  for (std::size_t i = 0; i < population.size(); ++i) {
    const Gates gates = population.gates(i);
    for (const double x : {population.potential_mV(i), gates.n, gates.m, gates.h}) {
      all.push_back(x);
    }
  }
  return all;
}

TEST(MembraneKernel, GivesTheSameBitsOnEveryInstructionSet) {
  constexpr int kColumns = 7;
  constexpr int kRows = 5;
  const auto network = LatticeCoupling::create({.gain = 0.3}, kColumns, kRows);
  for (const IntegrationMethod method : all_methods()) {
    for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
      for (const bool coupled : {false, true}) {
        for (const HodgkinHuxley& neuron : {HodgkinHuxley{}, general_slopes()}) {
          on_every_simd_target([&] {
            HodgkinHuxleyGroup population({.neuron = neuron,
                                           .method = method,
                                           .precision = precision,
                                           .freeze_resting = false},
                                          kColumns * kRows,
                                          coupled ? std::optional(*network) : std::nullopt);
            return history(population, 12);
          });
        }
      }
    }
  }
}

TEST(MembraneKernel, ANeuronsResultDoesNotDependOnItsPositionOrTheGroupSize) {
  for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
    HodgkinHuxleyGroup alone({.precision = precision}, 1, std::nullopt);
    HodgkinHuxleyGroup many({.precision = precision}, 50, std::nullopt);
    const double current = 9.0;
    const std::vector<double> currents(50, current);
    SpikeBuffer spikes(10'000);
    alone.advance({&current, 1}, {&current, 1}, 4000, nanoseconds{0}, spikes);
    many.advance(currents, currents, 4000, nanoseconds{0}, spikes);
    for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(many.potential_mV(i), alone.potential_mV(0));
  }
}

/// Both rates of every gate at given potentials, from the change in one tiny step of forward Euler.
std::vector<GateRates> rates_of_kernel(const HodgkinHuxley& neuron, Precision precision,
                                       const std::vector<double>& V_mV) {
  constexpr nanoseconds kStep{1000};
  HodgkinHuxleyGroup population({.neuron = neuron,
                                 .method = IntegrationMethod::kForwardEuler,
                                 .precision = precision,
                                 .step = kStep,
                                 .freeze_resting = false},
                                2 * V_mV.size(), std::nullopt);
  for (std::size_t i = 0; i < V_mV.size(); ++i) {
    population.set_state(2 * i, V_mV[i], {.n = 0.0, .m = 0.0, .h = 0.0});
    population.set_state(2 * i + 1, V_mV[i], {.n = 1.0, .m = 1.0, .h = 1.0});
  }
  const std::vector<double> none(2 * V_mV.size(), 0.0);
  SpikeBuffer spikes(2 * V_mV.size());
  population.advance(none, none, 1, nanoseconds{0}, spikes);
  const double step_ms = units::ms_from(kStep);
  std::vector<GateRates> rates;
  for (std::size_t i = 0; i < V_mV.size(); ++i) {
    const Gates opened = population.gates(2 * i);
    const Gates closed = population.gates(2 * i + 1);
    rates.push_back(
        {.alpha = {.n = opened.n / step_ms, .m = opened.m / step_ms, .h = opened.h / step_ms},
         .beta = {.n = (1.0 - closed.n) / step_ms,
                  .m = (1.0 - closed.m) / step_ms,
                  .h = (1.0 - closed.h) / step_ms}});
  }
  return rates;
}

void expect_rates(const GateRates& found, const GateRates& expected, double tolerance,
                  double V_mV) {
  const auto near = [&](double x, double y, const char* what) {
    // 1 − β·dt loses digits: an error relative to 1/dt.
    EXPECT_NEAR(x, y, tolerance * (std::fabs(y) + 1.0)) << what << " at " << V_mV << " mV";
  };
  near(found.alpha.n, expected.alpha.n, "alpha_n");
  near(found.alpha.m, expected.alpha.m, "alpha_m");
  near(found.alpha.h, expected.alpha.h, "alpha_h");
  near(found.beta.n, expected.beta.n, "beta_n");
  near(found.beta.m, expected.beta.m, "beta_m");
  near(found.beta.h, expected.beta.h, "beta_h");
}

/// Compares both paths in both precisions with the scalar rates, which use the library's exp.
void expect_library_rates(const std::vector<double>& V_mV) {
  for (const HodgkinHuxley& neuron : {HodgkinHuxley{}, general_slopes()}) {
    const auto in_double = rates_of_kernel(neuron, Precision::kDouble, V_mV);
    const auto in_float = rates_of_kernel(neuron, Precision::kFloat, V_mV);
    for (std::size_t i = 0; i < V_mV.size(); ++i) {
      const GateRates expected = HodgkinHuxley{}.rates(V_mV[i]);
      expect_rates(in_double[i], expected, 1e-11, V_mV[i]);
      expect_rates(in_float[i], expected, 2e-4, V_mV[i]);
    }
  }
}

TEST(MembraneKernel, RatesOfBothPathsAgreeWithTheLibraryFunctions) {
  std::vector<double> V_mV;
  for (double V = -109.0; V <= 69.0; V += 0.37) V_mV.push_back(V);
  expect_library_rates(V_mV);
}

TEST(MembraneKernel, SingularPotentialsAreExact) {
  // α_n is 0/0 at −55 mV, α_m at −40 mV.
  std::vector<double> V_mV;
  for (const double singular : {-55.0, -40.0}) {
    for (const double offset : {0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-5, -1e-5, 1e-2, -1e-2, 0.2}) {
      V_mV.push_back(singular + offset);
    }
  }
  expect_library_rates(V_mV);
}

TEST(MembraneKernel, SlopesThatShareNoExponentialGiveTheSameSpikes) {
  for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
    HodgkinHuxleyGroup shared({.precision = precision}, 20, std::nullopt);
    HodgkinHuxleyGroup general({.neuron = general_slopes(), .precision = precision}, 20,
                               std::nullopt);
    std::vector<double> current(20);
    for (std::size_t i = 0; i < 20; ++i) current[i] = 6.0 + static_cast<double>(i);
    SpikeBuffer a(1000);
    SpikeBuffer b(1000);
    shared.advance(current, current, 4000, nanoseconds{0}, a);
    general.advance(current, current, 4000, nanoseconds{0}, b);
    a.sort();
    b.sort();
    ASSERT_EQ(a.events().size(), b.events().size());
    for (std::size_t i = 0; i < a.events().size(); ++i) {
      EXPECT_EQ(a.events()[i].neuron, b.events()[i].neuron);
      const auto apart = a.events()[i].time - b.events()[i].time;
      EXPECT_LE(std::abs(apart.count()), precision == Precision::kDouble ? 1 : 5000);
    }
  }
}

/// Spikes in half a second of constant current, and whether a state turned non-finite.
struct Outcome {
  std::size_t spikes = 0;
  std::size_t resets = 0;
};
Outcome half_a_second(const HodgkinHuxley& neuron, IntegrationMethod method, int step_us,
                      double current, Precision precision = Precision::kDouble) {
  HodgkinHuxleyGroup population({.neuron = neuron,
                                 .method = method,
                                 .precision = precision,
                                 .step = microseconds{step_us},
                                 .freeze_resting = false},
                                1, std::nullopt);
  SpikeBuffer spikes(100'000);
  Outcome outcome;
  for (int step = 0; step < 500'000 / step_us; ++step) {
    population.advance({&current, 1}, {&current, 1}, 1, step * microseconds{step_us}, spikes);
    outcome.resets += population.resets().size();
  }
  outcome.spikes = spikes.events().size();
  return outcome;
}

constexpr std::size_t kSpikesAt10 = 35;  // at 5 µs with every method, and with CVODE

TEST(MembraneKernel, ExplicitMethodsDivergeAsPredicted) {
  // With rates that are not clamped to a range of potentials, as in textbooks.
  struct Bound {
    IntegrationMethod method;
    int works_us;
    int diverges_us;
  };
  for (const auto& [method, works_us, diverges_us] :
       {Bound{IntegrationMethod::kForwardEuler, 55, 75}, Bound{IntegrationMethod::kHeun, 65, 70},
        Bound{IntegrationMethod::kRk4, 80, 95}}) {
    const Outcome works = half_a_second(general_slopes(), method, works_us, 10.0);
    EXPECT_EQ(works.resets, 0U) << name_of(method);
    EXPECT_EQ(works.spikes, kSpikesAt10) << name_of(method);
    EXPECT_GT(half_a_second(general_slopes(), method, diverges_us, 10.0).resets, 0U)
        << name_of(method);
  }
  // Within the range of the shared exponential, the rates stay bounded, so divergence shows only
  // as a wrong result.
  EXPECT_NE(half_a_second({}, IntegrationMethod::kForwardEuler, 75, 10.0).spikes, kSpikesAt10);
  EXPECT_GT(half_a_second({}, IntegrationMethod::kHeun, 85, 10.0).resets, 0U);
  EXPECT_GT(half_a_second({}, IntegrationMethod::kRk4, 125, 10.0).resets, 0U);
  EXPECT_NE(half_a_second({}, IntegrationMethod::kStaggeredMultistep, 80, 10.0).spikes,
            kSpikesAt10);
}

TEST(MembraneKernel, AllMethodsCountSpikesCorrectlyAtTheirLargestStep) {
  for (const IntegrationMethod method : all_methods()) {
    const int step_us = static_cast<int>(1e3 * largest_step_alone_ms({}, method) + 1e-9) / 5 * 5;
    for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
      const Outcome outcome = half_a_second({}, method, step_us, 10.0, precision);
      EXPECT_EQ(outcome.spikes, kSpikesAt10) << name_of(method) << " " << step_us << " µs";
      EXPECT_EQ(outcome.resets, 0U);
    }
  }
}

TEST(MembraneKernel, StaggeredMethodsStayFiniteAtAnyStepAndCurrent) {
  for (const auto method : {IntegrationMethod::kCrankNicolson, IntegrationMethod::kRushLarsen}) {
    for (const HodgkinHuxley& neuron : {HodgkinHuxley{}, general_slopes()}) {
      for (const int step_us : {100, 500, 1000, 5000}) {
        for (const double current : {0.0, 10.0, 63.0, 160.0, 1000.0}) {
          EXPECT_EQ(half_a_second(neuron, method, step_us, current).resets, 0U)
              << name_of(method) << " " << step_us << " µs, " << current << " µA/cm²";
        }
      }
    }
  }
}

std::size_t resets_of_network(IntegrationMethod method, int step_us, double gain) {
  const auto network = LatticeCoupling::create({.gain = gain}, 5, 4);
  HodgkinHuxleyGroup population(
      {.method = method, .step = microseconds{step_us}, .freeze_resting = false}, 20, *network);
  std::vector<double> current(20);
  for (std::size_t i = 0; i < 20; ++i) current[i] = static_cast<double>(i);
  SpikeBuffer spikes(100'000);
  std::size_t resets = 0;
  for (int tick = 0; tick < 60; ++tick) {
    population.advance(current, current, 1000 / step_us, nanoseconds{0}, spikes);
    resets += population.resets().size();
  }
  return resets;
}

TEST(MembraneKernel, StrongCouplingBreaksExplicitMethodsOnly) {
  const auto rk4 = IntegrationMethod::kRk4;
  EXPECT_EQ(resets_of_network(rk4, 25, 60.0), 0U);
  EXPECT_GT(resets_of_network(rk4, 25, 100.0), 0U);
  EXPECT_EQ(resets_of_network(rk4, 50, 22.0), 0U);
  EXPECT_GT(resets_of_network(rk4, 50, 40.0), 0U);
  for (const auto method :
       {IntegrationMethod::kCrankNicolson, IntegrationMethod::kRushLarsen,
        IntegrationMethod::kBackwardEuler, IntegrationMethod::kExponentialEuler}) {
    for (const double gain : {25.0, 200.0, 5000.0}) {
      EXPECT_EQ(resets_of_network(method, 50, gain), 0U) << name_of(method) << " " << gain;
    }
  }
}

TEST(MembraneKernel, TheStepBoundOfANetworkPreventsDivergence) {
  for (const IntegrationMethod method : all_methods()) {
    for (const double gain : {1.0, 10.0, 100.0}) {
      const auto network = LatticeCoupling::create({.gain = gain}, 5, 4);
      const double bound_us = 1e3 * largest_step_ms(method, largest_step_alone_ms({}, method),
                                                    network->largest_conductance());
      for (const int step_us : {1, 2, 5, 10, 20, 25, 40, 50, 100}) {
        if (step_us > bound_us) continue;
        EXPECT_EQ(resets_of_network(method, step_us, gain), 0U)
            << name_of(method) << " " << step_us << " µs, gain " << gain;
      }
    }
  }
}

TEST(MembraneKernel, WithoutGainAllMethodsAreBitIdenticalToUncoupled) {
  const auto silent = LatticeCoupling::create({.gain = 0.0}, 5, 4);
  for (const IntegrationMethod method : all_methods()) {
    HodgkinHuxleyGroup alone({.method = method}, 20, std::nullopt);
    HodgkinHuxleyGroup network({.method = method}, 20, *silent);
    EXPECT_EQ(history(alone, 50), history(network, 50)) << name_of(method);
  }
}

TEST(MembraneKernel, ANonFiniteStateIsResetInEveryMethodAndReportedOnce) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto network = LatticeCoupling::create({}, 5, 4);
  for (const IntegrationMethod method : all_methods()) {
    for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
      HodgkinHuxleyGroup population({.method = method, .precision = precision, .patch = 3}, 20,
                                    *network);
      population.set_state(7, -65.0, {.n = nan, .m = 0.05, .h = 0.6});
      const std::vector<double> none(20, 0.0);
      SpikeBuffer spikes(100);
      population.advance(none, none, 40, std::chrono::milliseconds{5}, spikes);
      ASSERT_EQ(population.resets().size(), 1U) << name_of(method);
      EXPECT_EQ(population.resets()[0].neuron, 8U);
      EXPECT_EQ(population.resets()[0].patch, 3U);
      EXPECT_EQ(population.resets()[0].time, std::chrono::milliseconds{5} + nanoseconds{25'000});
      for (std::size_t i = 0; i < 20; ++i) {
        EXPECT_NEAR(population.potential_mV(i), -65.0, 1e-3) << name_of(method);
      }
      EXPECT_TRUE(spikes.events().empty());
      population.reset();
      EXPECT_TRUE(population.resets().empty());
    }
  }
}

}  // namespace
}  // namespace merkel
