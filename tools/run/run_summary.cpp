#include "tools/run/run_summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/contact/contact_validity.hpp"
#include "core/units.hpp"
#include "tools/run/counter_text.hpp"
#include "tools/run/device_summary.hpp"
#include "tools/run/loop_summary.hpp"
#include "tools/scene/contact_sentence.hpp"

namespace merkel {
namespace {

/// What the summary says of one afferent.
struct NeuronRow {
  std::size_t receptors = 0;
  double mean_distance_mm = 0.0;  ///< of its receptors from the axis of the patch's first probe
  std::uint64_t spikes = 0;
  double rate_hz = 0.0;
};

std::optional<std::size_t> first_probe_on(std::size_t patch, const TactileModel& model) {
  const auto& indenters = model.parameters().indenters;
  const auto found =
      std::find_if(indenters.begin(), indenters.end(),
                   [patch](const Indenter& indenter) { return indenter.patch == patch; });
  if (found == indenters.end()) return std::nullopt;
  return static_cast<std::size_t>(found - indenters.begin());
}

std::vector<NeuronRow> neuron_rows(const RunReport& report, const TactileModel& model) {
  std::vector<NeuronRow> rows(model.neurons());
  std::size_t first = 0;
  for (std::size_t patch = 0; patch < model.patches().size(); ++patch) {
    const auto probe = first_probe_on(patch, model);
    for (const Receptor& receptor : model.patches()[patch].drive().receptors()) {
      NeuronRow& row = rows[first + receptor.neuron - 1];
      ++row.receptors;
      if (!probe) continue;
      const Press& press = model.deepest()[*probe];
      row.mean_distance_mm += std::hypot(receptor.x_mm - press.x_mm, receptor.y_mm - press.y_mm);
    }
    first += model.patches()[patch].neurons();
  }
  const double simulated_s = units::s_from(report.simulated);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    NeuronRow& row = rows[n];
    if (row.receptors > 0) row.mean_distance_mm /= static_cast<double>(row.receptors);
    row.spikes = report.spikes_of_neuron[n];
    if (simulated_s > 0.0) row.rate_hz = static_cast<double>(row.spikes) / simulated_s;
  }
  return rows;
}

[[gnu::format(printf, 2, 3)]] void append(std::string& text, const char* format, ...) {
  std::array<char, 1024> line{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(line.data(), line.size(), format, arguments);
  va_end(arguments);
  text += line.data();
}

using Count = unsigned long long;

/// How long a tick took: the median on the host's clock, the mean with --fast.
double measured_tick_us(const RunReport& report) {
  if (report.host_time) return units::us_from(report.host_time->tick.p50);
  return report.ticks > 0 ? units::us_from(report.wall) / static_cast<double>(report.ticks) : 0.0;
}

/// What happened to the items at one hand-over, in the words of the text and of JSON.
using Handover = std::vector<std::pair<std::string_view, std::uint64_t>>;

Handover counts_of(const RunReport::OfProbe& probe) {
  return {{"samples_in", probe.samples_in},
          {"used", probe.counts.used},
          {"late", probe.counts.late},
          {"dropped", probe.dropped},
          {"unused", probe.unused},
          {"held_ticks", probe.counts.held_ticks},
          {"released_ticks", probe.counts.released_ticks},
          {"releases", probe.releases}};
}

Handover counts_of(const RunReport::OfSink& sink) {
  return {{"spikes_in", sink.spikes_in},
          {"delivered", sink.delivered},
          {"dropped", sink.dropped},
          {"lost", sink.lost()}};
}

/// " 600 samples in, 600 used, 0 late": separated by commas.
std::string handover_text(const Handover& counts) {
  std::string text;
  for (const auto& [name, count] : counts) {
    std::string words(name);
    std::replace(words.begin(), words.end(), '_', ' ');
    text += (text.empty() ? " " : ", ") + std::to_string(count) + " " + words;
  }
  return text;
}

void add_handover(nlohmann::ordered_json& json, const Handover& counts) {
  for (const auto& [name, count] : counts) json[std::string(name)] = count;
}

nlohmann::ordered_json press_json(const Press& press, const TactileModel& model,
                                  std::size_t indenter) {
  const ContactValidity validity = validity_of(press.contact, model.parameters().skin,
                                               model.parameters().indenters[indenter].radius_mm);
  return {{"depth_mm", press.contact.depth_mm},
          {"x_mm", press.x_mm},
          {"y_mm", press.y_mm},
          {"contact_radius_mm", press.contact.contact_radius_mm},
          {"force_N", units::N_from_mN(press.contact.force_mN)},
          {"peak_pressure_kPa", press.contact.peak_pressure_kPa},
          {"radius_ratio", validity.radius_ratio},
          {"sphere_force_error", validity.sphere_force_error},
          {"layer_ratio", validity.layer_ratio},
          {"layer_force_error", validity.layer_force_error},
          {"valid", validity.within},
          {"validity", contact_sentence(press, model, indenter)}};
}

nlohmann::ordered_json plan_part(const Plan& plan, const RunReport& report) {
  return {{"method", name_of(plan.chosen.method)},
          {"precision", name_of(plan.chosen.precision)},
          {"step_us", units::us_from(plan.chosen.step)},
          {"spike_time_us", plan.budget_us.value_or(0.0)},
          {"predicted_error_us", plan.chosen.error_us()},
          {"predicted_tick_us", plan.chosen.tick_us},
          {"measured_tick_us", measured_tick_us(report)}};
}

}  // namespace

std::string summary_text(const RunReport& report, const TactileModel& model, const Plan* plan) {
  std::string text;
  const double simulated_s = units::s_from(report.simulated);
  const double wall_s = units::s_from(report.wall);
  append(text, "simulated %.3f s in %.3f s (%.1f × real time)%s\n", simulated_s, wall_s,
         wall_s > 0.0 ? simulated_s / wall_s : 0.0, report.interrupted ? ", interrupted" : "");
  append(text, "counters, of ticks of %g ms:\n", units::ms_from(model.parameters().tick));
  text += counter_text(report);
  text += loop_text(report);
  if (plan != nullptr) {
    append(text,
           "planned with %s at %g µs in %s: predicted %.2f µs a tick, measured %.2f; spike times "
           "within %.3g µs in rehearsal, %g asked for\n",
           std::string(name_of(plan->chosen.method)).c_str(), units::us_from(plan->chosen.step),
           std::string(name_of(plan->chosen.precision)).c_str(), plan->chosen.tick_us,
           measured_tick_us(report), plan->chosen.error_us(), plan->budget_us.value_or(0.0));
  }
  for (std::size_t i = 0; i < report.probes.size(); ++i) {
    const RunReport::OfProbe& probe = report.probes[i];
    text += "probe " + probe.uri + ":" + handover_text(counts_of(probe)) + "\n";
    if (probe.device) text += device_text(*probe.device);
    const Press& press = model.deepest()[i];
    if (!press.touching()) {
      append(text, "  never touched the skin\n");
      continue;
    }
    append(text, "  deepest press %.4g mm at (%.4g, %.4g) mm: force %.4g N", press.contact.depth_mm,
           press.x_mm, press.y_mm, units::N_from_mN(press.contact.force_mN));
    if (press.contact.touching()) {
      append(text, ", contact radius %.4g mm, peak pressure %.4g kPa",
             press.contact.contact_radius_mm, press.contact.peak_pressure_kPa);
    }
    append(text, "\n  contact law: %s\n", contact_sentence(press, model, i).c_str());
  }
  if (model.closest_rims() < 1.0) {
    append(text,
           "contacts came within %.2f radii of each other: each lies where the other has bent the "
           "skin, so their sum is approximate\n",
           model.closest_rims());
  }
  for (const RunReport::OfSink& sink : report.sinks) {
    text += "sink " + sink.uri + ":" + handover_text(counts_of(sink)) + "\n";
    if (!sink.trouble.empty()) append(text, "  failed: %s\n", sink.trouble.c_str());
  }
  append(text, "neuron receptors mean_distance_mm spikes rate_hz\n");
  const std::vector<NeuronRow> rows = neuron_rows(report, model);
  // Of many, those that fired.
  const bool all = rows.size() <= 100;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    if (!all && rows[n].spikes == 0) continue;
    append(text, "%6zu %9zu %16.2f %6llu %7.1f\n", n + 1, rows[n].receptors,
           rows[n].mean_distance_mm, static_cast<Count>(rows[n].spikes), rows[n].rate_hz);
  }
  return text;
}

std::string summary_json(const RunReport& report, const TactileModel& model, const Plan* plan) {
  using Json = nlohmann::ordered_json;
  Json probes = Json::array();
  for (std::size_t i = 0; i < report.probes.size(); ++i) {
    const RunReport::OfProbe& probe = report.probes[i];
    const Press& press = model.deepest()[i];
    Json json = {{"uri", probe.uri}};
    add_handover(json, counts_of(probe));
    json["device"] = device_json(probe.device);
    json["deepest_press"] = press_json(press, model, i);
    probes.push_back(std::move(json));
  }
  Json sinks = Json::array();
  for (const RunReport::OfSink& sink : report.sinks) {
    Json json = {{"uri", sink.uri}};
    add_handover(json, counts_of(sink));
    json["trouble"] = sink.trouble;
    sinks.push_back(std::move(json));
  }
  Json neurons = Json::array();
  const std::vector<NeuronRow> rows = neuron_rows(report, model);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    neurons.push_back({{"neuron", n + 1},
                       {"receptors", rows[n].receptors},
                       {"mean_distance_mm", rows[n].mean_distance_mm},
                       {"spikes", rows[n].spikes},
                       {"rate_hz", rows[n].rate_hz}});
  }
  Json summary = {{"start_s", units::s_from(report.start)},
                  {"simulated_s", units::s_from(report.simulated)},
                  {"wall_s", units::s_from(report.wall)},
                  {"interrupted", report.interrupted}};
  add_counters(summary, report);
  summary["plan"] = plan != nullptr ? plan_part(*plan, report) : Json();
  summary["loop"] = loop_json(report);
  summary["closest_rims"] =
      std::isfinite(model.closest_rims()) ? Json(model.closest_rims()) : Json();
  summary["probes"] = std::move(probes);
  summary["sinks"] = std::move(sinks);
  summary["neurons"] = std::move(neurons);
  return summary.dump(2) + "\n";
}

}  // namespace merkel
