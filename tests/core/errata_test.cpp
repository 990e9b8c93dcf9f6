// Every departure from the printed paper, with the number that shows why (table in
// core/README.md). The printed forms exist only here.
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/receptors/patch.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

using std::numbers::pi;

constexpr double kFlat = std::numeric_limits<double>::infinity();
constexpr double kRadius = 2.0;
constexpr double kDepth = 1.5;
const SkinMaterial kSkin{SkinParameters{}};
const double kE = kSkin.reduced_modulus_kPa();

ContactState paper_press() { return HertzContact(kRadius, kFlat, kE).at_depth(kDepth); }

/// ∫ p dA over the contact of the paper's press.
template <class Pressure>
double integral_over_contact(Pressure p) {
  return reference::integrate([&](double r) { return 2.0 * pi * r * p(r); }, 0.0,
                              paper_press().contact_radius_mm);
}

TEST(Errata, Row01PressurePrefactorLacksPi) {
  const double a = paper_press().contact_radius_mm;
  const double printed = integral_over_contact(
      [&](double r) { return 2.0 * kE / kRadius * std::sqrt(a * a - r * r); });
  const double ours =
      integral_over_contact([&](double r) { return HertzContact::pressure_kPa(paper_press(), r); });
  EXPECT_NEAR(printed / paper_press().force_mN, pi, 1e-9);
  EXPECT_NEAR(ours / paper_press().force_mN, 1.0, 1e-9);
}

TEST(Errata, Row02ExponentialFactorDependsOnTheUnits) {
  const double a = paper_press().contact_radius_mm;
  const double F = paper_press().force_mN;
  const double in_mm_mN = std::exp(-1.0 * F / (2.67 * a));
  const double in_m_N = std::exp(-1e-6 * (F * 1e-3) / (2.67 * a * 1e-3));
  EXPECT_GT(std::fabs(in_mm_mN - in_m_N), 0.9);  // the same press, 1 mm from the axis
}

TEST(Errata, Row03ForceHasAPowerOfTheRadiusTooMany) {
  const double a = paper_press().contact_radius_mm;
  EXPECT_NEAR(4.0 * std::pow(a, 4) * kE / 3.0, 1570.8, 0.05);
  EXPECT_NEAR(4.0 * std::pow(a, 3) * kE / (3.0 * kRadius), 453.45, 0.005);
  EXPECT_NEAR(paper_press().force_mN, 453.45, 0.005);
}

TEST(Errata, Row04ReducedModulusIsPrintedAsItsReciprocal) {
  const double nu = kSkin.poisson_ratio();
  const double printed = (1.0 - nu * nu) / kSkin.youngs_modulus_kPa();
  EXPECT_NEAR(printed * kE, 1.0, 1e-14);
  EXPECT_LT(printed, 0.01);  // as a modulus, far too soft
}

TEST(Errata, Row05PeakPressureHasAContactRadiusTooMany) {
  const double a = paper_press().contact_radius_mm;
  const double printed_MPa = 2.0 * kE / (pi * a) * std::sqrt(kDepth / kRadius) * 1e-3;
  EXPECT_NEAR(printed_MPa, 0.041667, 5e-7);
  EXPECT_NEAR(paper_press().peak_pressure_kPa * 1e-3, 0.072169, 5e-7);
  // The pressure with the corrected peak carries the force; with the printed peak it does not.
  EXPECT_NEAR(2.0 / 3.0 * pi * a * a * paper_press().peak_pressure_kPa / paper_press().force_mN,
              1.0, 1e-12);
}

TEST(Errata, Row06InnerDisplacementIsTwiceTheDepthAndJumpsAtTheRim) {
  const ContactState press = paper_press();
  const double a = press.contact_radius_mm;
  const auto printed = [&](double r) {
    return pi * press.peak_pressure_kPa / (2.0 * a * kE) * (2.0 * a * a - r * r);
  };
  EXPECT_NEAR(printed(0.0), 2.0 * kDepth, 1e-12);
  EXPECT_NEAR(HertzContact::surface_displacement_mm(press, 0.0), kDepth, 1e-12);
  const double outside = HertzContact::surface_displacement_mm(press, a);
  EXPECT_GT(printed(a) - outside, 0.7);
  EXPECT_NEAR(HertzContact::surface_displacement_mm(press, a * (1.0 - 1e-12)), outside, 1e-10);
}

TEST(Errata, Row07OuterDisplacementTurnsNegative) {
  const ContactState press = paper_press();
  const double a = press.contact_radius_mm;
  const auto printed = [&](double r) {
    return (2.0 * a * a - r * r) * std::asin(a / r) +
           0.5 * r * a * std::sqrt(1.0 - a * a / (r * r));
  };
  EXPECT_GT(printed(1.816 * a), 0.0);
  EXPECT_LT(printed(1.818 * a), 0.0);
  for (double r = a; r < 100.0; r *= 1.1) {
    EXPECT_GT(HertzContact::surface_displacement_mm(press, r), 0.0);
  }
}

TEST(Errata, Row08InverseSineIsTheArcSine) {
  // Read as a reciprocal, the outer branch is discontinuous at the rim, where the bracket must be
  // π/2·a².
  EXPECT_GT(std::fabs(1.0 / std::sin(1.0) - 0.5 * pi), 0.3);
  EXPECT_DOUBLE_EQ(std::asin(1.0), 0.5 * pi);
}

TEST(Errata, Row09ShearModulusLacksATwo) {
  // Distortion energy of uniaxial stress: (1+ν)σ²/(3E).
  const double sigma = 10.0;
  const double nu = kSkin.poisson_ratio();
  const double E = kSkin.youngs_modulus_kPa();
  const double expected = (1.0 + nu) * sigma * sigma / (3.0 * E);
  const double octahedral2 = 2.0 * sigma * sigma / 9.0;
  const double printed = 3.0 * octahedral2 / (4.0 * (E / (1.0 + nu)));
  EXPECT_NEAR(printed / expected, 0.5, 1e-12);
  EXPECT_NEAR(energy_density_kPa(AxisymmetricStress{.sigma_z = sigma}, kSkin,
                                 EnergyDensity::kDistortional) /
                  expected,
              1.0, 1e-12);
}

TEST(Errata, Row10EnergyDensityIsTheDistortionalPartOnly) {
  const auto stress = huber_stress(paper_press(), kSkin.poisson_ratio(), 0.0, 0.65);
  const double distortional = energy_density_kPa(stress, kSkin, EnergyDensity::kDistortional);
  const double full = energy_density_kPa(stress, kSkin, EnergyDensity::kFull);
  EXPECT_NEAR(1.0 - distortional / full, 0.12, 0.01);
}

TEST(Errata, Row11PointLoadSeenFromTheDisplacementFallsWithDepth) {
  // The paper's Fig. 5 set-up, on the axis.
  const HertzContact law(5.0, kFlat, kE);
  double printed_before = std::numeric_limits<double>::infinity();
  double ours_before = 0.0;
  for (const double depth : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    const ContactState press = law.at_depth(depth);
    const double z = HertzContact::surface_displacement_mm(press, 0.0);
    const double printed =
        energy_density_kPa(point_load_stress(press.force_mN, kSkin.poisson_ratio(), 0.0, z), kSkin,
                           EnergyDensity::kDistortional);
    const double ours = energy_density_kPa(huber_stress(press, kSkin.poisson_ratio(), 0.0, 0.65),
                                           kSkin, EnergyDensity::kDistortional);
    if (depth > 1.0) {
      EXPECT_LT(printed, printed_before);
    }
    EXPECT_GT(ours, ours_before);
    printed_before = printed;
    ours_before = ours;
  }
}

TEST(Errata, Row12ThresholdBindsForShallowPressesOnly) {
  const HertzContact law(kRadius, kFlat, kE);
  EXPECT_NEAR(HertzContact::radius_of_displacement_mm(paper_press(), 0.005), 220.5, 0.05);
  EXPECT_LT(HertzContact::radius_of_displacement_mm(law.at_depth(0.02), 0.005), 1.0);
}

TEST(Errata, Row13GateEquationDivergesWithoutItsFactor) {
  // ẋ = α(1−x) − β, starting at rest: the gates leave [0, 1] within 0.2 ms.
  const HodgkinHuxley neuron;
  const auto [alpha, beta] = neuron.rates(neuron.V_rest);
  const Gates rest = neuron.steady_gates(neuron.V_rest);
  double m = rest.m;
  double fixed = rest.m;
  for (double t = 0.0; t < 0.2; t += 0.001) {
    m += 0.001 * (alpha.m * (1.0 - m) - beta.m);
    fixed += 0.001 * (alpha.m * (1.0 - fixed) - beta.m * fixed);
  }
  EXPECT_LT(m, -0.5);
  EXPECT_NEAR(fixed, rest.m, 1e-12);
}

/// Upward crossings of −20 mV in 100 ms at 10 µA/cm², by forward Euler at 10 µs, with the caller's
/// rates; the leak is rebalanced for them.
template <class Rates>
int spikes_with(Rates rates) {
  HodgkinHuxley neuron;
  const auto steady = [](double alpha, double beta) { return alpha / (alpha + beta); };
  GateRates k = rates(neuron.V_rest);
  Gates x{steady(k.alpha.n, k.beta.n), steady(k.alpha.m, k.beta.m), steady(k.alpha.h, k.beta.h)};
  const auto rest = neuron.channels(x, neuron.V_rest);
  const double leak = neuron.V_rest - (rest.driven - rest.conductance * neuron.V_rest) / neuron.g_L;
  double V = neuron.V_rest;
  int spikes = 0;
  for (int step = 0; step < 10'000; ++step) {
    constexpr double kStep = 0.01;
    k = rates(V);
    const auto membrane = neuron.channels(x, leak);
    const double before = V;
    V += kStep * (membrane.driven - membrane.conductance * V + 10.0);
    x.n += kStep * (k.alpha.n * (1.0 - x.n) - k.beta.n * x.n);
    x.m += kStep * (k.alpha.m * (1.0 - x.m) - k.beta.m * x.m);
    x.h += kStep * (k.alpha.h * (1.0 - x.h) - k.beta.h * x.h);
    spikes += before < -20.0 && V >= -20.0 ? 1 : 0;
  }
  return spikes;
}

TEST(Errata, Row14MisplacedOneInTheExponentialSilencesTheNeuron) {
  const HodgkinHuxley neuron;
  const int ours = spikes_with([&](double V) { return neuron.rates(V); });
  const int printed = spikes_with([&](double V) {
    GateRates k = neuron.rates(V);
    const double v = V - neuron.V_rest;
    k.alpha.n = 0.01 * (10.0 - v) / std::exp((10.0 - v) / 10.0 - 1.0);
    k.alpha.m = 0.1 * (25.0 - v) / std::exp((25.0 - v) / 10.0 - 1.0);
    k.beta.h = 1.0 / std::exp((30.0 - v) / 10.0 - 1.0);
    return k;
  });
  EXPECT_EQ(printed, 0);
  EXPECT_EQ(ours, 7);
}

TEST(Errata, Row15TheOldSignConventionClosesGatesOnDepolarisation) {
  const HodgkinHuxley neuron;
  const auto open_m = [&](double V) { return neuron.steady_gates(V).m; };
  EXPECT_GT(open_m(-45.0), open_m(-65.0));
  // The 1952 paper counts depolarisation as negative: its formulas at +v equal ours at −v.
  EXPECT_LT(open_m(-65.0 - 20.0), open_m(-65.0));
}

TEST(Errata, Row16WithTheClassicLeakTheCalciumTermMovesTheRest) {
  const HodgkinHuxley neuron;
  const auto rest_current = [&](double leak) {
    const auto rest = neuron.channels(neuron.steady_gates(neuron.V_rest), leak);
    return rest.driven - rest.conductance * neuron.V_rest;
  };
  EXPECT_GT(rest_current(-54.387), 0.5);  // µA/cm²: the resting potential rises
  EXPECT_NEAR(rest_current(neuron.leak_reversal_mV()), 0.0, 1e-12);
}

TEST(Errata, Row17WithoutACouplingTermNoNeighbourFeelsASpike) {
  const std::vector<double> current = {12.0, 0.0};
  const auto swing = [&](double gain) {
    HodgkinHuxleyGroup pair({}, 2, *LatticeCoupling::create({.gain = gain}, 2, 1));
    SpikeBuffer spikes(100);
    double largest = 0.0;
    for (int step = 0; step < 4000; ++step) {
      pair.advance(current, current, 1, std::chrono::nanoseconds{0}, spikes);
      largest = std::max(largest, std::fabs(pair.potential_mV(1) + 65.0));
    }
    return largest;
  };
  EXPECT_LT(swing(0.0), 1e-9);
  EXPECT_GT(swing(0.1), 0.3);
}

TEST(Errata, Row18ThePrintedDensityIsThatOfAfferents) {
  const auto receptors = place_receptors({}, Patch{});
  ASSERT_TRUE(receptors);
  const double per_afferent = static_cast<double>(receptors->size()) / Patch{}.subregions();
  EXPECT_EQ(per_afferent, 22.5);  // the paper cites 28 complexes per fibre
  EXPECT_LT(per_afferent, 28.0);
}

}  // namespace
}  // namespace merkel
