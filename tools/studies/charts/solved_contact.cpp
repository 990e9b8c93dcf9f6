// The contact solver: error against closed forms and cost, by the number of pixels.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/solver/press_tables.hpp"
#include "core/contact/solver/rigid_contact.hpp"
#include "core/contact/solver/tip_heights.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/bench/measure.hpp"
#include "tools/studies/charts/chart.hpp"
#include "tools/studies/reference/bonded_layer.hpp"
#include "tools/studies/reference/flat_punch.hpp"
#include "tools/studies/reference/sneddon_contact.hpp"

namespace merkel {
namespace {

constexpr double kDepth_mm = 0.6;
constexpr double kDiameter_mm = 3.0;
constexpr double kSphere_mm = 5.0;
constexpr double kConeAngle_deg = 140.0;
constexpr RigidContact::Accuracy kAccuracy{.tolerance = 5e-4, .most_iterations = 400};

using Stress = std::function<AxisymmetricStress(double r_mm)>;

struct Case {
  const char* name;
  TipHeight tip;
  double half_mm;   ///< of the contact
  double force_mN;  ///< closed form
  SkinParameters skin = {};
  Stress stress = {};  ///< at receptor depth, where there is a closed form
};

/// The largest error of the energy density at receptor depth, from the axis to twice the contact,
/// relative to its largest value; NaN without a closed form. The pixels' loads are summed directly.
double energy_error(const Case& each, const RigidContact& solver) {
  if (!each.stress) return std::numeric_limits<double>::quiet_NaN();
  const PixelGrid& grid = solver.grid();
  const SkinMaterial material(each.skin);
  const double area_mm2 = grid.pixel_mm * grid.pixel_mm;
  const PointResponse unit(LayeredMedium(each.skin), each.skin.receptor_depth_mm,
                           std::sqrt(area_mm2 / std::numbers::pi), 6.0 * each.half_mm);
  double largest = 0.0;
  double error = 0.0;
  constexpr int kPoints = 40;
  for (int k = 0; k <= kPoints; ++k) {
    const double x = 2.0 * each.half_mm * k / kPoints;
    CartesianStress sum;
    for (std::size_t j = 0; j < grid.rows; ++j) {
      for (std::size_t i = 0; i < grid.columns; ++i) {
        const double load_mN = solver.pressure_kPa()[j * grid.columns + i] * area_mm2;
        if (load_mN == 0.0) continue;
        const double dx = x - grid.x_mm(i);
        const double dy = -grid.y_mm(j);
        sum += cartesian(unit.stress(std::hypot(dx, dy)), dx, dy) * load_mN;
      }
    }
    const double exact = energy_density_kPa(each.stress(x), material, each.skin.energy_density);
    largest = std::max(largest, exact);
    error = std::max(
        error, std::fabs(energy_density_kPa(sum, material, each.skin.energy_density) - exact));
  }
  return error / largest;
}

/// A plate on a finger of two radii (Johnson, Contact Mechanics, section 4.2): the radii for which
/// the contact has half axes a and a·√(1−e²).
Case plate_on_finger(double modulus) {
  constexpr double kEccentricity = 0.75;
  constexpr double kHalf_mm = 3.0;
  const double k = std::comp_ellint_1(kEccentricity);
  const double l = std::comp_ellint_2(kEccentricity);
  const double b_over_a = std::sqrt(1.0 - kEccentricity * kEccentricity);
  const double p0 = kDepth_mm * modulus / (b_over_a * kHalf_mm * k);
  const double ea2 = kEccentricity * kEccentricity * kHalf_mm * kHalf_mm;
  const double along = kDepth_mm / (k * ea2) * (k - l);  // 1/2R
  const double across = kDepth_mm / (k * ea2) * (l / (b_over_a * b_over_a) - k);
  return {"plate on a finger (elliptic Hertz)",
          above_finger([](double, double) { return 0.0; }, 0.5 / along, 0.5 / across, {}),
          1.2 * kHalf_mm, 2.0 / 3.0 * p0 * std::numbers::pi * kHalf_mm * kHalf_mm * b_over_a};
}

/// On skin that is bonded to bone: the Fredholm equation.
Case sphere_on_layer(double hertz_mN) {
  const SkinParameters skin{.thickness_mm = 4.0};
  const reference::BondedLayer exact(skin.poisson_ratio);
  const double radius_mm = std::sqrt(kSphere_mm * kDepth_mm);
  return {"sphere on skin of 4 mm on bone (Fredholm)", sphere_height(kSphere_mm), 1.3 * radius_mm,
          hertz_mN * exact.force_factor(radius_mm / skin.thickness_mm), skin};
}

/// The sphere itself, not a paraboloid.
Case exact_sphere(double modulus) {
  const reference::SneddonContact exact(0.5 * kSphere_mm, modulus);
  return {"exact sphere (Sneddon)", exact_sphere_height(0.5 * kSphere_mm),
          std::sqrt(kSphere_mm * kDepth_mm), exact.at_depth(kDepth_mm).force_mN};
}

std::vector<Case> cases(const SkinParameters& skin) {
  const double modulus = SkinMaterial(skin).reduced_modulus_kPa();
  const HertzContact hertz(kSphere_mm, std::numeric_limits<double>::infinity(), modulus);
  const double slope = 1.0 / std::tan(0.5 * kConeAngle_deg * std::numbers::pi / 180.0);
  return {
      {"flat pin", pin_height(kDiameter_mm, 0.0), 0.5 * kDiameter_mm,
       kDiameter_mm * modulus * kDepth_mm, skin,
       [=](double r_mm) {
         return reference::flat_punch_stress(kDiameter_mm * modulus * kDepth_mm, 0.5 * kDiameter_mm,
                                             skin.poisson_ratio, r_mm, skin.receptor_depth_mm);
       }},
      {"sphere", sphere_height(kSphere_mm), std::sqrt(2.0 * kSphere_mm * kDepth_mm),
       hertz.at_depth(kDepth_mm).force_mN, skin,
       [=](double r_mm) {
         return huber_stress(hertz.at_depth(kDepth_mm), skin.poisson_ratio, r_mm,
                             skin.receptor_depth_mm);
       }},
      {"cone", cone_height(20.0, kConeAngle_deg, 0.0), kDepth_mm / slope,
       2.0 * modulus * kDepth_mm * kDepth_mm / (std::numbers::pi * slope)},
      plate_on_finger(modulus),
      exact_sphere(modulus),
      sphere_on_layer(hertz.at_depth(kDepth_mm).force_mN),
  };
}

PixelGrid pixels(double half_mm, std::size_t across) {
  return {.pixel_mm = 2.0 * half_mm / static_cast<double>(across - 1),
          .columns = across,
          .rows = across};
}

}  // namespace

Expected<std::string, SetupError> make_solved_contact_chart(const ReportFolder& /*folder*/,
                                                            ReportTables& tables) {
  CsvTable& table = tables.at("solved_contact.csv");
  const SkinParameters skin;
  std::string text = filled_page("chart_solved_contact", {{"depth_mm", kDepth_mm},
                                                          {"diameter_mm", kDiameter_mm},
                                                          {"sphere_mm", kSphere_mm},
                                                          {"angle_deg", kConeAngle_deg}});
  for (const Case& each : cases(skin)) {
    for (const std::size_t across : {17U, 33U, 63U, 127U}) {
      RigidContact solver(LayeredMedium(each.skin),
                          height_map(each.tip, pixels(each.half_mm, across)));
      RigidContact::Solution cold;
      const double cold_s = measure([&] {
                              solver.reset();
                              cold = solver.press(kDepth_mm, kAccuracy);
                            }).median_s;
      const double energy = energy_error(each, solver);
      RigidContact::Solution warm;
      double depth_mm = kDepth_mm;
      const double warm_s = measure([&] {
                              depth_mm = depth_mm == kDepth_mm ? kDepth_mm + 0.005 : kDepth_mm;
                              warm = solver.press(depth_mm, kAccuracy);
                            }).median_s;
      const double error = cold.force_mN / each.force_mN - 1.0;
      table.row({each.name},
                {static_cast<double>(across), error, energy, static_cast<double>(cold.iterations),
                 1e3 * cold_s, static_cast<double>(warm.iterations), 1e3 * warm_s});
      text += fmt::format("| {} | {}² | {:+.2f} % | {} | {} | {:.2f} | {} | {:.2f} |\n", each.name,
                          across, 100.0 * error,
                          std::isnan(energy) ? "–" : fmt::format("{:.2f} %", 100.0 * energy),
                          cold.iterations, 1e3 * cold_s, warm.iterations, 1e3 * warm_s);
    }
  }
  return text + "\n";
}

}  // namespace merkel
