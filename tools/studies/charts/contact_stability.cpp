// Where the contact solver stays right, and where it does not.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "core/contact/sliding_contact.hpp"
#include "core/contact/solver/tip_heights.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/charts/chart.hpp"
#include "tools/studies/reference/bonded_layer.hpp"

namespace merkel {
namespace {

constexpr double kPressed_mm = 0.6;
constexpr double kBall_mm = 5.0;
constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr RigidContact::Accuracy kWithin{.tolerance = 5e-4, .most_iterations = 400};

struct Trial {
  std::string what;
  double setting;
  int iterations;
  bool converged;
  double error;  ///< of the force
};

RigidContact::Solution pressed_once(const LayeredMedium& medium, const TipHeight& tip,
                                    double half_mm, double across, double depth_mm = kPressed_mm) {
  const auto pixels = static_cast<std::size_t>(across);
  const PixelGrid grid{.pixel_mm = 2.0 * half_mm / across, .columns = pixels, .rows = pixels};
  RigidContact solver(medium, height_map(tip, grid));
  return solver.press(depth_mm, kWithin);
}

/// A flat pin of some pixels, against the closed form.
void small_features(std::vector<Trial>& rows) {
  const SkinParameters skin;
  const double exact = 1.0 * SkinMaterial(skin).reduced_modulus_kPa() * kPressed_mm;
  for (const double pixels : {0.5, 1.0, 2.0, 4.0, 6.0, 12.0, 24.0}) {
    const double across = std::ceil(pixels) + 4.0;
    const auto found =
        pressed_once(LayeredMedium(skin), pin_height(1.0, 0.0), 0.5 * across / pixels, across);
    rows.push_back({"a pin of this many pixels", pixels, found.iterations, found.converged,
                    found.force_mN / exact - 1.0});
  }
}

/// A sphere on nearly incompressible skin, ever thinner, against the Fredholm equation.
void thin_layers(std::vector<Trial>& rows) {
  for (const double poisson_ratio : {0.48, 0.499, 0.4999, 0.5}) {
    const reference::BondedLayer exact(poisson_ratio);
    for (const double thickness_mm : {4.0, 1.5, 0.75}) {
      const LayeredMedium medium({{.thickness_mm = thickness_mm,
                                   .youngs_modulus_kPa = 50.0,
                                   .poisson_ratio = poisson_ratio}});
      const double hertz = 4.0 / 3.0 * medium.reduced_modulus_kPa() * std::sqrt(kBall_mm) *
                           std::pow(kPressed_mm, 1.5);
      const double radius_mm = std::sqrt(kBall_mm * kPressed_mm);
      const auto found = pressed_once(medium, sphere_height(kBall_mm), 1.5 * radius_mm, 97);
      rows.push_back(
          {fmt::format("skin of this thickness on bone, mm, Poisson ratio {}", poisson_ratio),
           thickness_mm, found.iterations, found.converged,
           found.force_mN / (hertz * exact.force_factor(radius_mm / thickness_mm)) - 1.0});
    }
  }
}

/// A sphere on an epidermis of 0.1 mm that is this many times stiffer than the skin below, against
/// pixels half as wide.
void stiff_epidermis(std::vector<Trial>& rows) {
  for (const double ratio : {1.0, 10.0, 100.0, 1000.0}) {
    const LayeredMedium medium(
        {{.thickness_mm = 0.1, .youngs_modulus_kPa = 50.0 * ratio, .poisson_ratio = 0.48},
         {.thickness_mm = kEndless, .youngs_modulus_kPa = 50.0, .poisson_ratio = 0.48}});
    const auto coarse = pressed_once(medium, sphere_height(kBall_mm), 2.6, 65);
    const auto fine = pressed_once(medium, sphere_height(kBall_mm), 2.6, 130);
    rows.push_back({"an epidermis of 0.1 mm, this many times stiffer", ratio, coarse.iterations,
                    coarse.converged, coarse.force_mN / fine.force_mN - 1.0});
  }
}

/// Two cones under a slope: one contact splits in two, and they merge again. Each depth starts from
/// the pressure of the one before; the force is compared with that of a cold start.
void splits_and_merges(std::vector<Trial>& rows) {
  const TipHeight cone = cone_height(20.0, 140.0, 0.05);
  const TipHeight twins = turned(
      [=](double x, double y) { return std::min(cone(x - 1.0, y), cone(x + 1.0, y)); }, 0.0, 8.0);
  const PixelGrid grid{.pixel_mm = 0.08, .columns = 61, .rows = 41};
  RigidContact warm(LayeredMedium(SkinParameters{}), height_map(twins, grid));
  RigidContact cold = warm;
  for (const double depth_mm : {0.05, 0.6, 1.2, 0.3, 0.05}) {
    const auto found = warm.press(depth_mm, kWithin);
    cold.reset();
    rows.push_back({"two cones, this depth next, mm", depth_mm, found.iterations, found.converged,
                    found.force_mN / cold.press(depth_mm, kWithin).force_mN - 1.0});
  }
}

struct Slide {
  double speed_mm_per_s;
  double poor, force_error, energy_error;
};

/// Dots of 1 mm, 3.2 mm apart, against the contact at rest, one latency ago.
Slide slide(double speed_mm_per_s) {
  constexpr Position kApex{15.0, 10.0};
  const SkinParameters skin{.radius_mm = 7.0, .radius_along_mm = 14.0, .apex = kApex};
  const Indenter dots{
      .tip = DotsTip{.centres = {{0.0, 0.0}}, .diameter_mm = 1.0, .edge_radius_mm = 0.2},
      .surface = {.slides = true, .relief_mm = 0.5, .period_x_mm = 3.2, .period_y_mm = 3.2}};
  SlidingContact moving(dots, skin, std::chrono::milliseconds(1), 0.0);
  SlidingContact still(dots, skin, std::chrono::milliseconds(1), 0.0);
  const auto place = [&](int tick) {
    return ContactInput{.depth_mm = 0.8,
                        .x_mm = kApex.x_mm + 1e-3 * speed_mm_per_s * tick,
                        .y_mm = kApex.y_mm + 0.3};
  };
  const auto energy_kPa = [&](const SlidingContact& contact, double x_mm) {
    return energy_density_kPa(contact.at(x_mm, 0.2).stress, SkinMaterial(skin),
                              skin.energy_density);
  };
  Slide found{
      .speed_mm_per_s = speed_mm_per_s, .poor = 0.0, .force_error = 0.0, .energy_error = 0.0};
  double largest = 0.0;
  int tick = 0;
  const auto run = [&](int until) {
    for (; tick < until; ++tick) {
      moving.take(place(tick));
      moving.work();
    }
  };
  run(120);
  for (int look = 1; look <= 24; ++look) {
    run(120 + 9 * look);
    still.settle(place(tick - 1 - moving.plan().latency()));
    found.force_error =
        std::max(found.force_error,
                 std::fabs(moving.press().contact.force_mN / still.press().contact.force_mN - 1.0));
    for (double x = -4.0; x <= 4.0; x += 0.31) {
      largest = std::max(largest, energy_kPa(still, x));
      found.energy_error =
          std::max(found.energy_error, std::fabs(energy_kPa(moving, x) - energy_kPa(still, x)));
    }
  }
  found.energy_error /= largest;
  found.poor =
      static_cast<double>(moving.report().poor) / static_cast<double>(moving.report().solutions);
  return found;
}

}  // namespace

Expected<std::string, SetupError> make_contact_stability_chart(const ReportFolder& /*folder*/,
                                                               ReportTables& tables) {
  CsvTable& table = tables.at("contact_stability.csv");
  std::vector<Trial> rows;
  small_features(rows);
  thin_layers(rows);
  stiff_epidermis(rows);
  splits_and_merges(rows);
  std::string text = filled_page("chart_contact_stability", {{"pressed_mm", kPressed_mm}});
  for (const Trial& row : rows) {
    table.row({row.what}, {row.setting, static_cast<double>(row.iterations),
                           row.converged ? 1.0 : 0.0, row.error});
    text += fmt::format("| {} | {} | {} | {} | {:+.2f} % |\n", row.what, row.setting,
                        row.iterations, row.converged ? "yes" : "no", 100.0 * row.error);
  }
  CsvTable& slides = tables.at("fast_slides.csv");
  text += filled_page("chart_fast_slides");
  for (const double speed : {10.0, 40.0, 80.0, 160.0, 320.0, 640.0}) {
    const Slide each = slide(speed);
    slides.row({speed, each.poor, each.force_error, each.energy_error});
    text += fmt::format("| {} | {:.0f} % | {:.2f} % | {:.1f} % |\n", speed, 100.0 * each.poor,
                        100.0 * each.force_error, 100.0 * each.energy_error);
  }
  return text + "\n";
}

}  // namespace merkel
