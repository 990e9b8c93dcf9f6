#include "core/contact/bar_contact.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "core/contact/bar_press.hpp"
#include "core/contact/flat_tip_field.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/studies/reference/flat_tip_boundary_elements.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

using std::numbers::pi;

constexpr double kModulus = 130.9;

CartesianStress stress_at(const BarContact& contact, double nu, double x, double y, double z) {
  CartesianStress sum;
  for (const LineLoad& load : contact.loads) sum += line_load_stress(load, nu, x, y, z);
  return sum;
}

TEST(LineLoad, EqualsTheIntegralOfPointLoadsAlongIt) {
  const LineLoad load{.x_mm = 0.4, .half_length_mm = 3.0, .force_per_length_mN_per_mm = 7.0};
  for (const double nu : {0.0, 0.3, 0.48}) {
    for (const auto& [x, y, z] :
         {std::tuple{0.4, 0.0, 0.65}, {1.7, 2.0, 0.3}, {-2.0, -4.5, 1.0}, {0.5, 3.0, 0.1}}) {
      const auto component = [&, x = x, y = y, z = z](double CartesianStress::*member) {
        return reference::integrate(
            [&](double eta) {
              const double dx = x - load.x_mm;
              const double dy = y - eta;
              const double r = std::hypot(dx, dy);
              return cartesian(point_load_stress(load.force_per_length_mN_per_mm, nu, r, z), dx,
                               dy).*
                     member;
            },
            -load.half_length_mm, load.half_length_mm);
      };
      const CartesianStress ours = line_load_stress(load, nu, x, y, z);
      for (double CartesianStress::*const member :
           {&CartesianStress::sigma_x, &CartesianStress::sigma_y, &CartesianStress::sigma_z,
            &CartesianStress::tau_xy, &CartesianStress::tau_yz, &CartesianStress::tau_zx}) {
        EXPECT_NEAR(ours.*member, component(member), 1e-9);
      }
    }
  }
}

TEST(LineLoad, DisplacementIsThatOfPointLoadsAlongIt) {
  const LineLoad load{.x_mm = 0.0, .half_length_mm = 3.0, .force_per_length_mN_per_mm = 7.0};
  const double expected = reference::integrate(
      [](double eta) { return 7.0 / (pi * kModulus * std::hypot(0.8, 1.5 - eta)); }, -3.0, 3.0);
  EXPECT_NEAR(line_load_displacement_mm(load, kModulus, 0.8, 1.5), expected, 1e-12);
}

// Independent solution: uniform strips with constant pressure, collocated at their centres;
// ∫ asinh(c/|t|) dt = t·asinh(c/|t|) + c·asinh(t/c).
struct Strips {
  std::vector<double> x;
  Eigen::VectorXd pressure;
  double width;
};
Strips solve_by_strips(const BarTip& tip, int per_bar) {
  Strips strips;
  strips.width = tip.widths_mm[0] / per_bar;
  for (std::size_t bar = 0; bar < tip.widths_mm.size(); ++bar) {
    for (int i = 0; i < per_bar; ++i) {
      strips.x.push_back(tip.centre_mm(bar) - 0.5 * tip.widths_mm[bar] + (i + 0.5) * strips.width);
    }
  }
  const double c = 0.5 * tip.length_mm;
  const auto antiderivative = [c](double t) {
    return t == 0.0 ? 0.0 : t * std::asinh(c / std::fabs(t)) + c * std::asinh(t / c);
  };
  const auto count = static_cast<Eigen::Index>(strips.x.size());
  Eigen::MatrixXd matrix(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const double apart =
          strips.x[static_cast<std::size_t>(i)] - strips.x[static_cast<std::size_t>(j)];
      matrix(i, j) =
          2.0 / (pi * kModulus) *
          (antiderivative(apart + 0.5 * strips.width) - antiderivative(apart - 0.5 * strips.width));
    }
  }
  strips.pressure = matrix.partialPivLu().solve(Eigen::VectorXd::Ones(count));
  return strips;
}

// The strips converge linearly in their width (the edges are singular): 400 per bar are within 0.3
// %.
TEST(BarContact, AgreesWithAnIndependentStripSolution) {
  const BarTip tip;
  const BarContact ours = BarContact::solve(tip, kModulus, 0.65);
  const Strips strips = solve_by_strips(tip, 400);
  const double force = strips.pressure.sum() * strips.width * tip.length_mm;
  EXPECT_NEAR(ours.force_mN_per_mm / force, 1.0, 1e-3);
  for (const double x : {-11.5, -9.0, -6.5, -5.0, -3.5, -1.0, 1.5, 4.0, 6.5, 12.0}) {
    CartesianStress sum;
    for (std::size_t i = 0; i < strips.x.size(); ++i) {
      sum += line_load_stress({.x_mm = strips.x[i],
                               .half_length_mm = 0.5 * tip.length_mm,
                               .force_per_length_mN_per_mm =
                                   strips.pressure(static_cast<Eigen::Index>(i)) * strips.width},
                              0.48, x, 0.0, 0.65);
    }
    const CartesianStress spectral = stress_at(ours, 0.48, x, 0.0, 0.65);
    EXPECT_NEAR(spectral.sigma_x, sum.sigma_x, 0.04) << x;
    EXPECT_NEAR(spectral.sigma_z, sum.sigma_z, 0.04) << x;
    EXPECT_NEAR(spectral.tau_zx, sum.tau_zx, 0.04) << x;
  }
}

TEST(BarContact, MoreNodesChangeNothing) {
  const BarTip tip;
  const BarContact coarse = BarContact::solve(tip, kModulus, 0.65);
  const BarContact fine = BarContact::solve(tip, kModulus, 0.2);
  EXPECT_GT(fine.loads.size(), coarse.loads.size());
  EXPECT_NEAR(coarse.force_mN_per_mm / fine.force_mN_per_mm, 1.0, 1e-6);
  for (double x = -13.0; x < 13.0; x += 0.37) {
    EXPECT_NEAR(stress_at(coarse, 0.48, x, 1.0, 0.65).sigma_z,
                stress_at(fine, 0.48, x, 1.0, 0.65).sigma_z, 2e-6);
  }
}

TEST(BarContact, VerticalStressCarriesTheForceAtAnyDepth) {
  const BarTip tip{.widths_mm = {1.0}, .gaps_mm = {}, .length_mm = 2.0};
  const BarContact contact = BarContact::solve(tip, kModulus, 0.65);
  double sum = 0.0;
  const double step = 0.25;
  for (double x = -60.0; x <= 60.0; x += step) {
    for (double y = -60.0; y <= 60.0; y += step) {
      sum -= stress_at(contact, 0.3, x, y, 0.65).sigma_z * step * step;
    }
  }
  EXPECT_NEAR(sum / contact.force_mN_per_mm, 1.0, 1e-3);
}

TEST(BarContact, PressureOfALongBarIsThatOfAFlatPunch) {
  // p = P/(π√(b²−x²)): the Gauss-Chebyshev loads of a single long bar are all equal.
  const BarTip tip{.widths_mm = {2.0}, .gaps_mm = {}, .length_mm = 1e4};
  const BarContact contact = BarContact::solve(tip, kModulus, 0.65);
  for (const LineLoad& load : contact.loads) {
    EXPECT_NEAR(load.force_per_length_mN_per_mm / contact.loads.front().force_per_length_mN_per_mm,
                1.0, 1e-6);
  }
}

TEST(BarContact, EveryLoadIsCompressive) {
  for (const LineLoad& load : BarContact::solve(BarTip{}, kModulus, 0.65).loads) {
    EXPECT_GT(load.force_per_length_mN_per_mm, 0.0);
  }
}

TEST(FlatTipField, InterpolatesTheSuperposition) {
  const BarTip tip;
  const SkinParameters skin;
  const FlatTipField field(tip, skin);
  const BarContact contact = loads_under_bars(tip, skin, 1.0, skin.receptor_depth_mm);
  // 0.025 % of the peak of σz.
  constexpr double kTolerance_kPa = 3e-3;
  for (double x = -14.03; x < 14.0; x += 0.517) {
    for (const double y : {0.0, 3.3, -9.7, 10.4, -12.0}) {
      const CartesianStress exact = stress_at(contact, skin.poisson_ratio, x, y, 0.65);
      const CartesianStress ours = field.at(x, y, 1.0).stress;
      for (double CartesianStress::*const member :
           {&CartesianStress::sigma_x, &CartesianStress::sigma_y, &CartesianStress::sigma_z,
            &CartesianStress::tau_xy, &CartesianStress::tau_yz, &CartesianStress::tau_zx}) {
        EXPECT_NEAR(ours.*member, exact.*member, kTolerance_kPa) << x << ", " << y;
      }
    }
  }
}

TEST(FlatTipField, FarAwayTheTipIsAPointLoad) {
  const BarTip tip{.widths_mm = {2.0}, .gaps_mm = {}, .length_mm = 3.0};
  const FlatTipField field(tip, {});
  // On both sides of the grid's border, 10 mm from the tip.
  for (const double x : {10.8, 11.5}) {
    const auto point = point_load_stress(field.force_mN(1.0), 0.48, x, 0.65);
    EXPECT_NEAR(field.at(x, 0.0, 1.0).stress.sigma_x / point.sigma_r, 1.0, 0.03) << x;
    EXPECT_NEAR(
        field.at(x, 0.0, 1.0).displacement /
            (field.force_mN(1.0) / (pi * SkinMaterial(SkinParameters{}).reduced_modulus_kPa() * x)),
        1.0, 0.01);
  }
}

// Boundary elements (tools/studies/reference) for one bar on a finger of 7 mm radius;
// core/README.md states the same errors.
TEST(FlatTipField, OnACurvedFingerItAgreesWithBoundaryElements) {
  struct Case {
    double width_mm, depth_mm, force, middle, edge;  ///< allowed errors
  };
  for (const Case& c : {Case{1.0, 0.3, 0.01, 0.01, 0.02}, Case{1.0, 1.5, 0.02, 0.05, 0.04},
                        Case{3.0, 0.3, 0.05, 0.12, 0.08}, Case{3.0, 0.7, 0.04, 0.03, 0.03},
                        Case{3.0, 1.5, 0.03, 0.15, 0.02}}) {
    const SkinParameters skin{.radius_mm = 7.0};
    const SkinMaterial material(skin);
    const BarTip tip{.widths_mm = {c.width_mm}, .gaps_mm = {}, .length_mm = 20.0};
    const reference::FlatTipBoundaryElements elements(
        {.reduced_modulus_kPa = material.reduced_modulus_kPa(),
         .poisson_ratio = skin.poisson_ratio,
         .width_mm = c.width_mm,
         .length_mm = tip.length_mm,
         .skin_radius_mm = skin.radius_mm,
         .depth_mm = c.depth_mm});
    const FlatTipField field(tip, skin);
    EXPECT_NEAR(field.force_mN(c.depth_mm) / elements.force_mN(), 1.0, c.force);
    const auto ratio = [&](double x) {
      const auto energy = [&](const CartesianStress& stress) {
        return energy_density_kPa(stress, material, EnergyDensity::kDistortional);
      };
      return energy(field.at(x, 0.0, c.depth_mm).stress) / energy(elements.stress(x, 0.0, 0.65));
    };
    EXPECT_NEAR(ratio(0.0), 1.0, c.middle) << c.width_mm << " " << c.depth_mm;
    EXPECT_NEAR(ratio(0.5 * c.width_mm), 1.0, c.edge) << c.width_mm << " " << c.depth_mm;
    // The table reproduces the line loads from which it was made.
    const BarContact loads = loads_under_bars(tip, skin, c.depth_mm, 0.65);
    const double peak = -stress_at(loads, skin.poisson_ratio, 0.0, 0.0, 0.65).sigma_z;
    for (const double y : {0.0, 1.1, -3.0}) {
      EXPECT_NEAR(field.at(0.4, y, c.depth_mm).stress.sigma_z,
                  stress_at(loads, skin.poisson_ratio, 0.4, y, 0.65).sigma_z, 0.025 * peak);
    }
    EXPECT_NEAR(field.depth_mm(field.force_mN(c.depth_mm)), c.depth_mm, 1e-9);
  }
}

TEST(FlatTipField, AShortBarOnACurvedFingerEventuallyTouchesAlongItsWholeLength) {
  const SkinParameters skin{.radius_mm = 7.0};
  const BarTip tip{.widths_mm = {1.0}, .gaps_mm = {}, .length_mm = 3.0};
  const FlatTipField curved(tip, skin);
  const FlatTipField flat(tip, {});
  // Beyond that depth, it is as stiff as on flat skin.
  EXPECT_NEAR(curved.force_mN(4.0) - curved.force_mN(3.0), flat.force_mN(1.0),
              1e-6 * flat.force_mN(1.0));
  EXPECT_LT(curved.force_mN(1.0), flat.force_mN(1.0));
  EXPECT_EQ(curved.force_mN(0.0), 0.0);
  EXPECT_EQ(curved.force_mN(-1.0), 0.0);
}

TEST(BarTip, RefusesOverlappingBarsAndEmptyRows) {
  EXPECT_EQ((BarTip{.widths_mm = {}, .gaps_mm = {}}.check().error().key), "probe.bar_widths_mm");
  EXPECT_EQ((BarTip{.widths_mm = {5.0, -1.0}, .gaps_mm = {1.0}}.check().error().key),
            "probe.bar_widths_mm");
  EXPECT_NE(
      (BarTip{.widths_mm = {5.0, 5.0}, .gaps_mm = {-1.0}}.check().error().reason).find("overlap"),
      std::string::npos);
  EXPECT_EQ((BarTip{.widths_mm = {5.0, 5.0}, .gaps_mm = {}}.check().error().key),
            "probe.bar_gaps_mm");
  EXPECT_TRUE(BarTip{}.check());
}

}  // namespace
}  // namespace merkel
