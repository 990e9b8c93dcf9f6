#include "tools/run/run_summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/contact/contact_validity.hpp"
#include "core/units.hpp"
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
  append(text, "ticks: %llu of %g ms; %llu overruns", static_cast<Count>(report.ticks),
         units::ms_from(model.parameters().tick), static_cast<Count>(report.overruns));
  if (report.overruns > 0) {
    append(text, " (longest %.3f ms; %llu by a late wake-up, %llu by a long computation)",
           units::ms_from(report.longest_overrun), static_cast<Count>(report.late_wake_ups),
           static_cast<Count>(report.long_computes));
  }
  append(text, ", %llu ticks caught up, %llu gaps of %llu ticks\n",
         static_cast<Count>(report.catch_up_ticks), static_cast<Count>(report.gaps),
         static_cast<Count>(report.skipped_ticks));
  text += loop_text(report);
  if (plan != nullptr) {
    append(text,
           "planned with %s at %g µs in %s: predicted %.2f µs a tick, measured %.2f; spike times "
           "within %.3g µs in rehearsal, %g asked for\n",
           std::string(name_of(plan->chosen.method)).c_str(), units::us_from(plan->chosen.step),
           std::string(name_of(plan->chosen.precision)).c_str(), plan->chosen.tick_us,
           measured_tick_us(report), plan->chosen.error_us(), plan->budget_us.value_or(0.0));
  }
  if (report.neuron_resets > 0) {
    append(text, "neurons reset after a non-finite state: %llu\n",
           static_cast<Count>(report.neuron_resets));
  }
  for (std::size_t i = 0; i < report.probes.size(); ++i) {
    const RunReport::OfProbe& probe = report.probes[i];
    append(text,
           "probe %s: %llu samples in, %llu used, %llu late, %llu dropped, %llu unused; "
           "held for %llu ticks, released %llu times for %llu ticks\n",
           probe.uri.c_str(), static_cast<Count>(probe.samples_in),
           static_cast<Count>(probe.counts.used), static_cast<Count>(probe.counts.late),
           static_cast<Count>(probe.dropped), static_cast<Count>(probe.unused),
           static_cast<Count>(probe.counts.held_ticks), static_cast<Count>(probe.releases),
           static_cast<Count>(probe.counts.released_ticks));
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
  append(text, "spikes: %llu\n", static_cast<Count>(report.spikes));
  for (const RunReport::OfSink& sink : report.sinks) {
    append(text, "sink %s: %llu spikes in, %llu delivered, %llu dropped, %llu lost\n",
           sink.uri.c_str(), static_cast<Count>(sink.spikes_in), static_cast<Count>(sink.delivered),
           static_cast<Count>(sink.dropped),
           static_cast<Count>(sink.spikes_in - sink.dropped - sink.delivered));
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
    const ContactValidity validity = validity_of(press.contact, model.parameters().skin,
                                                 model.parameters().indenters[i].radius_mm);
    probes.push_back({{"uri", probe.uri},
                      {"samples_in", probe.samples_in},
                      {"used", probe.counts.used},
                      {"late", probe.counts.late},
                      {"dropped", probe.dropped},
                      {"unused", probe.unused},
                      {"held_ticks", probe.counts.held_ticks},
                      {"released_ticks", probe.counts.released_ticks},
                      {"releases", probe.releases},
                      {"device", device_json(probe.device)},
                      {"deepest_press",
                       {{"depth_mm", press.contact.depth_mm},
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
                        {"validity", contact_sentence(press, model, i)}}}});
  }
  Json sinks = Json::array();
  for (const RunReport::OfSink& sink : report.sinks) {
    sinks.push_back({{"uri", sink.uri},
                     {"spikes_in", sink.spikes_in},
                     {"delivered", sink.delivered},
                     {"dropped", sink.dropped},
                     {"lost", sink.spikes_in - sink.dropped - sink.delivered},
                     {"trouble", sink.trouble}});
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
  const Json summary = {
      {"start_s", units::s_from(report.start)},
      {"simulated_s", units::s_from(report.simulated)},
      {"wall_s", units::s_from(report.wall)},
      {"interrupted", report.interrupted},
      {"ticks", report.ticks},
      {"overruns", report.overruns},
      {"longest_overrun_ms", units::ms_from(report.longest_overrun)},
      {"overruns_by_late_wake_up", report.late_wake_ups},
      {"overruns_by_long_compute", report.long_computes},
      {"catch_up_ticks", report.catch_up_ticks},
      {"gaps", report.gaps},
      {"skipped_ticks", report.skipped_ticks},
      {"plan", plan != nullptr ? plan_part(*plan, report) : Json()},
      {"neuron_resets", report.neuron_resets},
      {"events_dropped", report.events_dropped},
      {"loop", loop_json(report)},
      {"closest_rims", std::isfinite(model.closest_rims()) ? Json(model.closest_rims()) : Json()},
      {"spikes", report.spikes},
      {"probes", std::move(probes)},
      {"sinks", std::move(sinks)},
      {"neurons", std::move(neurons)}};
  return summary.dump(2) + "\n";
}

}  // namespace merkel
