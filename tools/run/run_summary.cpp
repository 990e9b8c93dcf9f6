#include "tools/run/run_summary.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/json_text.hpp"
#include "tools/number_text.hpp"
#include "tools/run/afferent_summary.hpp"
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

/// The counts at one stage, with their names in the text and in JSON.
using Handover = std::vector<std::pair<std::string_view, std::uint64_t>>;

Handover counts_of(const RunReport::ProbeReport& probe) {
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
  Handover counts = {{"spikes_in", sink.spikes_in},
                     {"delivered", sink.delivered},
                     {"dropped", sink.dropped},
                     {"lost", sink.lost()}};
  if (sink.commands_in > 0) counts.emplace_back("commands_in", sink.commands_in);
  return counts;
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

void add_handover(Json& json, const Handover& counts) {
  for (const auto& [name, count] : counts) json[std::string(name)] = count;
}

Json plan_part(const Plan& plan, const RunReport& report) {
  return {{"method", name_of(plan.chosen.method)},
          {"precision", name_of(plan.chosen.precision)},
          {"step_us", units::us_from(plan.chosen.step)},
          {"spike_time_us", plan.budget_us.value_or(0.0)},
          {"predicted_error_us", plan.chosen.measured() ? Json(plan.chosen.error_us()) : Json()},
          {"predicted_tick_us", plan.chosen.tick_us},
          {"measured_tick_us", measured_tick_us(report)}};
}

Json timing_json(const RunReport::ProbeReport& probe) {
  if (!probe.timing) return {};
  return {{"period_ms", units::ms_from(probe.timing->period)},
          {"jitter_ms", units::ms_from(probe.timing->jitter)},
          {"delay_ms", units::ms_from(probe.timing->delay)},
          {"stale_after_ms", units::ms_from(probe.stale_after)}};
}

double samples_per_tick(const RunReport::ProbeReport& probe, const RunReport& report) {
  return report.ticks == 0
             ? 0.0
             : static_cast<double>(probe.counts.used) / static_cast<double>(report.ticks);
}

std::string_view name_of(ProbeInput::Decimate decimate) noexcept {
  return decimate == ProbeInput::Decimate::kMean ? "mean" : "last";
}

/// What became of the samples of a probe that is faster than the loop; empty for others.
std::string decimation_text(const RunReport::ProbeReport& probe, const RunReport& report) {
  constexpr double kSeveral = 1.5;
  const double samples = samples_per_tick(probe, report);
  if (samples < kSeveral) return {};
  const bool mean = probe.decimate == ProbeInput::Decimate::kMean;
  return fmt::format(
      "  {:.3g} samples in a tick: {}\n", samples,
      mean ? "their mean is used" : "the last is used ([probe] decimate = \"mean\" averages them)");
}

/// How the readings of a probe came.
std::string readings_text(const RunReport& report, const RunReport::ProbeReport& probe) {
  std::string text = "probe " + probe.uri + ":" + handover_text(counts_of(probe)) + "\n";
  if (probe.timing && !probe.shares_device) {
    text += fmt::format(
        "  a sample every {:.4g} ms with {} ms of jitter: the loop delay is {:.4g} ms ({} to {}, "
        "median {}), and the press is released after {:.4g} ms of silence\n",
        units::ms_from(probe.timing->period), number_text(units::ms_from(probe.timing->jitter)),
        units::ms_from(report.delay), number_text(units::ms_from(report.smallest_delay)),
        number_text(units::ms_from(report.largest_delay)),
        number_text(units::ms_from(report.median_delay)), units::ms_from(probe.stale_after));
  }
  text += decimation_text(probe, report);
  if (probe.device && !probe.shares_device) text += device_text(*probe.device);
  return text;
}

std::string sink_text(const RunReport::OfSink& sink) {
  const Handover counts = sink.spikes_in == 0 && sink.commands_in > 0
                              ? Handover{{"commands_in", sink.commands_in}}
                              : counts_of(sink);
  std::string text = "sink " + sink.uri + ":" + handover_text(counts) + "\n";
  if (!sink.error_message.empty()) text += fmt::format("  failed: {}\n", sink.error_message);
  return text;
}

std::string planned_text(const Plan& plan, const RunReport& report) {
  return fmt::format(
      "planned with {} at {:g} µs in {}: predicted {:.2f} µs per tick, measured {:.2f}; {}, limit "
      "{:g} µs\n",
      name_of(plan.chosen.method), units::us_from(plan.chosen.step), name_of(plan.chosen.precision),
      plan.chosen.tick_us, measured_tick_us(report),
      plan.chosen.measured()
          ? fmt::format("spike times within {:.3g} µs in rehearsal", plan.chosen.error_us())
          : "nothing fired in rehearsal, so the most accurate method was taken",
      plan.budget_us.value_or(0.0));
}

}  // namespace

std::string summary_text(const RunReport& report, const TactileModel& model, const Plan* plan,
                         bool all_afferents, std::string_view preset) {
  std::string text;
  const double simulated_s = units::s_from(report.simulated);
  const double wall_s = units::s_from(report.wall);
  text += fmt::format("simulated {:.3f} s in {:.3f} s", simulated_s, wall_s);
  // A live run keeps to the clock, however fast this machine could simulate.
  if (!report.host_time && wall_s > 0.0) {
    text += fmt::format(" ({:.1f} × real time)", simulated_s / wall_s);
  }
  text += report.interrupted ? ", interrupted\n" : "\n";
  for (std::size_t i = 0; i < report.probes.size(); ++i)
    text += touch_text(report, model, i, preset);
  if (model.closest_rims() < 1.0) {
    text += fmt::format(
        "contacts came within {:.2f} radii of each other: each lies on skin that the other has "
        "deformed, so their sum is approximate\n",
        model.closest_rims());
  }
  const std::string silence = silence_text(report, model);
  if (!silence.empty()) text += silence + "\n";
  text += afferent_text(afferent_rows(report, model), all_afferents);
  text += verdict_text(verdict_of(report, model), report);
  for (const RunReport::OfSink& sink : report.sinks) text += sink_text(sink);
  for (const RunReport::ProbeReport& probe : report.probes) text += readings_text(report, probe);
  if (plan != nullptr) text += planned_text(*plan, report);
  text += loop_text(report);
  text += fmt::format("counters (ticks of {:g} ms):\n", units::ms_from(model.parameters().tick));
  return text + counter_text(report);
}

std::string summary_json(const RunReport& report, const TactileModel& model, const Plan* plan) {
  Json probes = Json::array();
  for (std::size_t i = 0; i < report.probes.size(); ++i) {
    const RunReport::ProbeReport& probe = report.probes[i];
    Json json = {{"uri", probe.uri}};
    add_handover(json, counts_of(probe));
    json["samples_per_tick"] = samples_per_tick(probe, report);
    json["decimate"] = name_of(probe.decimate);
    json["timing"] = timing_json(probe);
    json["device"] = device_json(probe.shares_device ? std::nullopt : probe.device);
    json["force_and_depth"] = both_json(report, model, i);
    json["deepest_press"] = press_json(model, i);
    probes.push_back(std::move(json));
  }
  Json sinks = Json::array();
  for (const RunReport::OfSink& sink : report.sinks) {
    Json json = {{"uri", sink.uri}};
    add_handover(json, counts_of(sink));
    json["error_message"] = sink.error_message;
    sinks.push_back(std::move(json));
  }
  Json summary = {{"start_s", units::s_from(report.start)},
                  {"simulated_s", units::s_from(report.simulated)},
                  {"wall_s", units::s_from(report.wall)},
                  {"interrupted", report.interrupted},
                  {"verdict", verdict_json(verdict_of(report, model))},
                  {"delay_ms", units::ms_from(report.delay)},
                  {"smallest_delay_ms", units::ms_from(report.smallest_delay)},
                  {"median_delay_ms", units::ms_from(report.median_delay)},
                  {"largest_delay_ms", units::ms_from(report.largest_delay)}};
  add_counters(summary, report);
  const std::string silence = silence_text(report, model);
  summary["silence"] = silence.empty() ? Json() : Json(silence);
  summary["plan"] = plan != nullptr ? plan_part(*plan, report) : Json();
  summary["loop"] = loop_json(report);
  summary["closest_rims"] =
      std::isfinite(model.closest_rims()) ? Json(model.closest_rims()) : Json();
  summary["probes"] = std::move(probes);
  summary["sinks"] = std::move(sinks);
  summary["neurons"] = afferent_json(afferent_rows(report, model));
  return json_text(summary);
}

}  // namespace merkel
