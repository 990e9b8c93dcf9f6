// Fig. 4: firing rate along a grating of flat bars.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/contact/tip_field.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/receptors/sigmoid_transduction.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/figures/rates.hpp"

namespace merkel {
namespace {

constexpr double kDepth_mm = 1.0;
constexpr double kReceptors = 22.5;  // mean number per afferent, 450/20
constexpr double kSpacing_mm = 0.1;
constexpr double kReach_mm = 18.0;

/// Mean rates of neurons over a second under constant currents.
std::vector<double> steady_rates(const std::vector<double>& currents) {
  HodgkinHuxleyGroup neurons({}, currents.size(), std::nullopt);
  SpikeBuffer spikes(currents.size() * 1000);
  neurons.advance(currents, currents, 40'000, std::chrono::nanoseconds{0}, spikes);
  std::vector<double> rates(currents.size());
  for (const SpikeEvent& spike : std::as_const(spikes).events()) rates[spike.neuron - 1] += 1.0;
  return rates;
}

}  // namespace

Expected<std::string, SetupError> make_grating(const ReportFolder& /*folder*/,
                                               ReportTables& tables) {
  const BarTip tip;  // bars of 5 mm, gaps of 3 and 5 mm
  const SkinParameters skin;
  const SkinMaterial material(skin);
  const SigmoidTransduction transduction;
  const TipField field({.tip = tip}, skin);

  std::vector<double> x;
  std::vector<double> energy;
  std::vector<double> current;
  for (double at = -kReach_mm; at <= kReach_mm + 1e-9; at += kSpacing_mm) {
    x.push_back(at);
    energy.push_back(
        energy_density_kPa(field.at(at, 0.0, kDepth_mm).stress, material, skin.energy_density));
    current.push_back(kReceptors * transduction.current_uA_per_cm2(energy.back()));
  }
  const std::vector<double> rate = steady_rates(current);
  CsvTable& table = tables.at("fig4_grating.csv");
  const auto under_bar = [&tip](double at) {
    for (std::size_t bar = 0; bar < tip.widths_mm.size(); ++bar) {
      if (std::fabs(at - tip.centre_mm(bar)) <= 0.5 * tip.widths_mm[bar]) return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < x.size(); ++i) {
    table.row({x[i], energy[i], current[i], rate[i], under_bar(x[i]) ? 1.0 : 0.0});
  }

  // The highest values within 1 mm of an edge, and the lowest within 1 mm of a bar's centre.
  const auto extreme = [&](const std::vector<double>& values, double near, bool highest) {
    std::optional<double> best;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (std::fabs(x[i] - near) > 1.0) continue;
      if (!best || (highest ? values[i] > *best : values[i] < *best)) best = values[i];
    }
    return *best;
  };
  struct Edge {
    const char* at;
    double x_mm;
  };
  const double first = -0.5 * tip.total_width_mm();
  const std::vector<Edge> edges = {
      {"gap of 3 mm", first + 5.0}, {"gap of 5 mm", first + 13.0}, {"open skin", first + 23.0}};
  Json rows = Json::array();
  std::vector<double> rates;
  std::vector<double> energies;
  for (const Edge& edge : edges) {
    rates.push_back(extreme(rate, edge.x_mm, true));
    energies.push_back(extreme(energy, edge.x_mm, true));
    rows.push_back({{"at", edge.at}, {"energy", energies.back()}, {"rate", rates.back()}});
  }
  const double interior_rate = extreme(rate, tip.centre_mm(1), false);
  const double interior_energy = extreme(energy, tip.centre_mm(1), false);
  const bool ordered = energies[0] < energies[1] && energies[1] < energies[2];
  const bool enhanced = rates[0] > 2.0 * std::max(interior_rate, 1.0);
  return filled_page("figure_grating",
                     {{"edges", std::move(rows)},
                      {"inside_energy", interior_energy},
                      {"inside_rate", interior_rate},
                      {"enhanced", enhanced},
                      {"ordered", ordered && rates[0] <= rates[1] && rates[1] <= rates[2]}});
}

}  // namespace merkel
