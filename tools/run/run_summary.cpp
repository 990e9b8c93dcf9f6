#include "tools/run/run_summary.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/tactile_patch.hpp"
#include "core/units.hpp"
#include "tools/filled_text.hpp"
#include "tools/run/counter_text.hpp"
#include "tools/run/device_summary.hpp"
#include "tools/run/loop_summary.hpp"
#include "tools/run/silence.hpp"
#include "tools/run/touch_summary.hpp"
#include "tools/run/verdict.hpp"

namespace merkel {
namespace {

/// Duration of a tick: the median on the host's clock; with --fast, the mean.
double measured_tick_us(const RunReport& report) {
  if (report.host_time) return units::us_from(report.host_time->tick.p50);
  return report.ticks > 0 ? units::us_from(report.wall) / static_cast<double>(report.ticks) : 0.0;
}

double samples_per_tick(const RunReport::ProbeReport& probe, const RunReport& report) {
  return report.ticks == 0
             ? 0.0
             : static_cast<double>(probe.counts.used) / static_cast<double>(report.ticks);
}

std::string_view name_of(ProbeInput::Decimate decimate) noexcept {
  return decimate == ProbeInput::Decimate::kMean ? "mean" : "last";
}

Json probe_json(const RunReport& report, const TactileModel& model, std::size_t i,
                std::string_view preset) {
  constexpr double kSeveral = 1.5;
  const RunReport::ProbeReport& probe = report.probes[i];
  const double samples = samples_per_tick(probe, report);
  Json timing = probe.timing ? timing_json(*probe.timing) : Json();
  if (probe.timing) timing["stale_after_ms"] = units::ms_from(probe.stale_after);
  return {{"uri", probe.uri},
          {"name", name_of_probe(model, i)},
          {"samples_in", probe.samples_in},
          {"used", probe.counts.used},
          {"late", probe.counts.late},
          {"dropped", probe.dropped},
          {"unused", probe.unused},
          {"held_ticks", probe.counts.held_ticks},
          {"released_ticks", probe.counts.released_ticks},
          {"releases", probe.releases},
          {"samples_per_tick", samples},
          {"several_per_tick", samples >= kSeveral},
          {"decimate", name_of(probe.decimate)},
          {"timing", std::move(timing)},
          {"shares_device", probe.shares_device},
          {"device", device_json(probe.shares_device ? std::nullopt : probe.device)},
          {"force_and_depth", both_json(report, model, i)},
          {"deepest_press", press_json(model, i, preset)}};
}

Json sink_json(const RunReport::OfSink& sink) {
  return {{"uri", sink.uri},
          {"spikes_in", sink.spikes_in},
          {"delivered", sink.delivered},
          {"dropped", sink.dropped},
          {"lost", sink.lost()},
          {"commands_in", sink.commands_in},
          {"commands_refused", sink.commands_refused},
          {"error_message", sink.error_message}};
}

/// The deepest press of the patch's first probe that touched it; null if none did.
const Press* first_press_on(std::size_t patch, const TactileModel& model) {
  const auto& indenters = model.parameters().indenters;
  for (std::size_t i = 0; i < indenters.size(); ++i) {
    const Press& press = model.deepest()[i];
    if (indenters[i].patch == patch && press.touching()) return &press;
  }
  return nullptr;
}

/// Distance and rate during contact are null if no probe touched the patch.
Json afferent_json(const RunReport& report, const TactileModel& model) {
  Json rows = Json::array();
  const auto rate_Hz = [](std::uint64_t spikes, double time_s) {
    return time_s > 0.0 ? Json(static_cast<double>(spikes) / time_s) : Json();
  };
  for (std::size_t patch = 0; patch < model.patches().size(); ++patch) {
    const std::size_t first = rows.size();
    const std::size_t neurons = model.patches()[patch].neurons();
    std::vector<std::size_t> receptors(neurons);
    std::vector<double> distance_mm(neurons);  // from the axis of the press
    const Press* const press = first_press_on(patch, model);
    for (const Receptor& receptor : model.patches()[patch].drive().receptors()) {
      ++receptors[receptor.neuron - 1];
      if (press == nullptr) continue;
      distance_mm[receptor.neuron - 1] +=
          std::hypot(receptor.x_mm - press->x_mm, receptor.y_mm - press->y_mm);
    }
    const double contact_s = static_cast<double>(report.contact_ticks_of_patch[patch]) *
                             units::s_from(model.parameters().tick);
    for (std::size_t i = 0; i < neurons; ++i) {
      const std::size_t n = first + i;
      const auto count = static_cast<double>(std::max<std::size_t>(receptors[i], 1));
      const Json whole = rate_Hz(report.spikes_of_neuron[n], units::s_from(report.simulated));
      rows.push_back(
          {{"neuron", n + 1},
           {"receptors", receptors[i]},
           {"mean_distance_mm", press != nullptr ? Json(distance_mm[i] / count) : Json()},
           {"spikes", report.spikes_of_neuron[n]},
           {"rate_hz", whole.is_null() ? Json(0.0) : whole},
           {"contact_rate_hz", rate_Hz(report.contact_spikes_of_neuron[n], contact_s)}});
    }
  }
  return rows;
}

}  // namespace

Json summary_json(const RunReport& report, const TactileModel& model, const Json& plan,
                  const Scene& scene) {
  const double simulated_s = units::s_from(report.simulated);
  const double wall_s = units::s_from(report.wall);
  // A live run keeps to the clock, however fast this machine could simulate.
  const bool fast = !report.host_time && wall_s > 0.0;
  Json summary = {{"start_s", units::s_from(report.start)},
                  {"simulated_s", simulated_s},
                  {"wall_s", wall_s},
                  {"real_time_factor", fast ? Json(simulated_s / wall_s) : Json()},
                  {"interrupted", report.interrupted},
                  {"error_message", report.error_message},
                  {"verdict", verdict_json(verdict_of(report, model))},
                  {"tick_ms", units::ms_from(model.parameters().tick)},
                  {"delay_ms", units::ms_from(report.delay)},
                  {"smallest_delay_ms", units::ms_from(report.smallest_delay)},
                  {"median_delay_ms", units::ms_from(report.median_delay)},
                  {"largest_delay_ms", units::ms_from(report.largest_delay)}};
  add_counters(summary, report);
  const std::string silence = silence_text(report, model);
  summary["silence"] = silence.empty() ? Json() : Json(silence);
  summary["plan"] = plan;
  if (!plan.is_null()) summary["plan"]["measured_tick_us"] = measured_tick_us(report);
  summary["loop"] = loop_json(report);
  summary["closest_rims"] =
      std::isfinite(model.closest_rims()) ? Json(model.closest_rims()) : Json();
  summary["contacts_overlap"] = model.closest_rims() < 1.0;
  summary["probes"] = Json::array();
  for (std::size_t i = 0; i < report.probes.size(); ++i) {
    summary["probes"].push_back(probe_json(report, model, i, scene.preset));
  }
  summary["validity"] = validity_json(scene, model, &report);
  summary["sinks"] = Json::array();
  for (const RunReport::OfSink& sink : report.sinks) summary["sinks"].push_back(sink_json(sink));
  summary["neurons"] = afferent_json(report, model);
  return summary;
}

std::string summary_text(Json summary, bool all_afferents) {
  constexpr std::size_t kShown = 10;
  std::vector<Json> rows(summary["neurons"].begin(), summary["neurons"].end());
  const auto fired = static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [](const Json& row) { return row["spikes"] > 0; }));
  const auto activity = [](const Json& row) {
    const Json& rate_Hz = row["contact_rate_hz"];
    return std::pair(rate_Hz.is_null() ? Json(0.0) : rate_Hz, row["spikes"]);
  };
  std::stable_sort(rows.begin(), rows.end(),
                   [&](const Json& a, const Json& b) { return activity(a) > activity(b); });
  const std::size_t shown = all_afferents ? rows.size() : std::min(kShown, fired);
  summary["afferents"] = {
      {"fired", fired}, {"all", rows.size()}, {"shown", shown}, {"in_part", shown < rows.size()}};
  rows.resize(shown);
  summary["most_active"] = rows;
  return filled_text("summary", summary) + counter_text(summary);
}

}  // namespace merkel
