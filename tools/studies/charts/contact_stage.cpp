// Chart 2: speed against accuracy of the contact stage.
#include <chrono>
#include <cmath>
#include <functional>
#include <vector>

#include <fmt/core.h>

#include "core/contact/huber_stress.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/receptors/receptor_drive.hpp"
#include "core/scene/drive_reach.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/bench/measure.hpp"
#include "tools/studies/charts/chart.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

constexpr std::size_t kAfferents = 20;

using Stress = std::function<AxisymmetricStress(double r_mm)>;

/// Currents of all afferents, receptor by receptor, from a stress law.
std::vector<double> currents(const std::vector<Receptor>& receptors, const PlacedContact& placed,
                             const Stress& stress) {
  const SkinParameters skin;
  const SkinMaterial material(skin);
  const SigmoidTransduction transduction;
  std::vector<double> sums(kAfferents);
  for (const Receptor& receptor : receptors) {
    const double r = std::hypot(receptor.x_mm - placed.x_mm, receptor.y_mm - placed.y_mm);
    sums[receptor.neuron - 1] += transduction.current_uA_per_cm2(
        energy_density_kPa(stress(r), material, skin.energy_density));
  }
  return sums;
}

double largest_difference(std::span<const double> a, std::span<const double> b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::fabs(a[i] - b[i]));
  return largest;
}

}  // namespace

Expected<std::string, SetupError> make_contact_chart(const ReportFolder& folder,
                                                     ReportTables& tables) {
  CsvTable& table = tables.at("contact_stage.csv");
  const SkinParameters skin;
  const TipContact tip(Indenter{}, skin);
  const auto receptors = *place_receptors({}, {});
  // Not at the paper's centre, where no afferent is near its threshold.
  const PlacedContact placed{.contact = tip.sphere()->at_depth(1.5), .x_mm = 8.0, .y_mm = 10.0};
  const auto superposition = [&](double tolerance) {
    return [&, tolerance](double r) {
      const reference::Stress s = reference::superposed_stress(
          placed.contact.peak_pressure_kPa, placed.contact.contact_radius_mm, skin.poisson_ratio, r,
          skin.receptor_depth_mm, tolerance);
      return AxisymmetricStress{
          .sigma_r = s.r, .sigma_theta = s.theta, .sigma_z = s.z, .tau_rz = s.rz};
    };
  };
  const auto reference = currents(receptors, placed, superposition(1e-13));
  std::string text = filled_page("chart_contact_stage");
  const auto row = [&](const std::string& name, double parameter, double cost_s, double error,
                       std::size_t reached) {
    table.row({name}, {parameter, 1e6 * cost_s, error, static_cast<double>(reached)});
    text += fmt::format("| {}{} | {:.3g} | {:.2g} | {} |\n", name,
                        parameter > 0.0 ? fmt::format(" {:.0e}", parameter) : "", 1e6 * cost_s,
                        error, reached);
  };
  for (const double tolerance : {1e-2, 1e-4, 1e-7}) {
    const auto begin = std::chrono::steady_clock::now();
    const auto found = currents(receptors, placed, superposition(tolerance));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    row("superposition", tolerance, took.count(), largest_difference(found, reference), kAfferents);
  }
  folder.report(0.5);
  const Stress huber = [&](double r) {
    return huber_stress(placed.contact, skin.poisson_ratio, r, skin.receptor_depth_mm);
  };
  std::vector<double> found;
  const double scalar_s = measure([&] { found = currents(receptors, placed, huber); }).median_s;
  row("scalar closed form", 0.0, scalar_s, largest_difference(found, reference), kAfferents);
  for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
    const std::string name = precision == Precision::kDouble ? "kernel" : "kernel in float";
    for (const double tolerance : {0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
      ReceptorDrive drive(receptors, kAfferents, {.precision = precision});
      const DriveReach reach(tip, skin, {}, tolerance, 1);
      PlacedContact now = placed;
      now.reach_mm = reach.radius_mm(placed.contact.depth_mm);
      drive.compute({&now, 1});
      const double error = largest_difference(drive.output(), reference);
      const double cost_s = measure([&] {
                              now.x_mm = now.x_mm == 8.0 ? 8.0 + 1e-9 : 8.0;
                              drive.compute({&now, 1});
                            }).median_s;
      row(tolerance > 0.0 ? name + " culled at" : name, tolerance, cost_s, error,
          drive.afferents_reached());
    }
  }
  return text + "\n";
}

}  // namespace merkel
