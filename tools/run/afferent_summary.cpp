#include "tools/run/afferent_summary.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/json_text.hpp"

namespace merkel {
namespace {

constexpr std::size_t kShown = 10;

std::optional<std::size_t> first_probe_on(std::size_t patch, const TactileModel& model) {
  const auto& indenters = model.parameters().indenters;
  const auto found =
      std::find_if(indenters.begin(), indenters.end(),
                   [patch](const Indenter& indenter) { return indenter.patch == patch; });
  if (found == indenters.end()) return std::nullopt;
  return static_cast<std::size_t>(found - indenters.begin());
}

}  // namespace

std::vector<AfferentActivity> afferent_rows(const RunReport& report, const TactileModel& model) {
  std::vector<AfferentActivity> rows(model.neurons());
  const double simulated_s = units::s_from(report.simulated);
  std::size_t first = 0;
  for (std::size_t patch = 0; patch < model.patches().size(); ++patch) {
    const std::size_t neurons = model.patches()[patch].neurons();
    const auto probe = first_probe_on(patch, model);
    for (const Receptor& receptor : model.patches()[patch].drive().receptors()) {
      AfferentActivity& row = rows[first + receptor.neuron - 1];
      ++row.receptors;
      if (!probe) continue;
      const Press& press = model.deepest()[*probe];
      row.mean_distance_mm += std::hypot(receptor.x_mm - press.x_mm, receptor.y_mm - press.y_mm);
    }
    const double contact_s = static_cast<double>(report.contact_ticks_of_patch[patch]) *
                             units::s_from(model.parameters().tick);
    for (std::size_t n = first; n < first + neurons; ++n) {
      AfferentActivity& row = rows[n];
      row.neuron = n + 1;
      if (row.receptors > 0) row.mean_distance_mm /= static_cast<double>(row.receptors);
      row.spikes = report.spikes_of_neuron[n];
      if (simulated_s > 0.0) row.rate_hz = static_cast<double>(row.spikes) / simulated_s;
      if (contact_s > 0.0) {
        row.contact_rate_hz = static_cast<double>(report.contact_spikes_of_neuron[n]) / contact_s;
      }
    }
    first += neurons;
  }
  return rows;
}

std::string afferent_text(std::vector<AfferentActivity> rows, bool all) {
  const auto fired = static_cast<std::size_t>(std::count_if(
      rows.begin(), rows.end(), [](const AfferentActivity& row) { return row.spikes > 0; }));
  std::stable_sort(rows.begin(), rows.end(),
                   [](const AfferentActivity& a, const AfferentActivity& b) {
                     const double a_hz = a.contact_rate_hz.value_or(0.0);
                     const double b_hz = b.contact_rate_hz.value_or(0.0);
                     return a_hz != b_hz ? a_hz > b_hz : a.spikes > b.spikes;
                   });
  std::string text = fmt::format("afferents: {} of {} fired", fired, rows.size());
  const std::size_t shown = all ? rows.size() : std::min(kShown, fired);
  if (shown == 0) return text + "\n";
  text += shown < rows.size()
              ? fmt::format("; the {} most active (--all prints every one):\n", shown)
              : std::string(":\n");
  text += "neuron receptors mean_distance_mm spikes contact_hz whole_run_hz\n";
  for (std::size_t i = 0; i < shown; ++i) {
    const AfferentActivity& row = rows[i];
    text += fmt::format("{:>6} {:>9} {:>16.2f} {:>6} {:>10} {:>12.1f}\n", row.neuron, row.receptors,
                        row.mean_distance_mm, row.spikes,
                        row.contact_rate_hz ? fmt::format("{:.1f}", *row.contact_rate_hz) : "-",
                        row.rate_hz);
  }
  return text;
}

Json afferent_json(const std::vector<AfferentActivity>& rows) {
  Json neurons = Json::array();
  for (const AfferentActivity& row : rows) {
    neurons.push_back(
        {{"neuron", row.neuron},
         {"receptors", row.receptors},
         {"mean_distance_mm", row.mean_distance_mm},
         {"spikes", row.spikes},
         {"rate_hz", row.rate_hz},
         {"contact_rate_hz", row.contact_rate_hz ? Json(*row.contact_rate_hz) : Json()}});
  }
  return neurons;
}

}  // namespace merkel
