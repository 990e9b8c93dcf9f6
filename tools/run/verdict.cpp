#include "tools/run/verdict.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/contact/sliding_contact.hpp"
#include "core/units.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "tools/filled_text.hpp"
#include "tools/number_text.hpp"
#include "tools/run/endless_touch.hpp"
#include "tools/run/force_and_depth.hpp"
#include "tools/run/touch_summary.hpp"

namespace merkel {
namespace {

using Severity = Finding::Severity;
using std::chrono::nanoseconds;

constexpr std::size_t kMaxFindings = 5;
constexpr double kMuchPoor = 0.2;     ///< share of solutions
constexpr double kMuchMoved = 0.02;   ///< of the largest energy density
constexpr double kOld_ms = 50.0;      ///< mean age at arrival: bursts
constexpr double kMuch = 0.01;        ///< share of ticks, samples or commands that is reported
constexpr double kLostTouch_s = 1.0;  ///< longer releases without an outage: touch was lost
constexpr double kLostTouch = 0.5;    ///< or this share of a short run
constexpr double kShortRelease_s = 0.01;
constexpr double kMisread_mN = -20.0;  ///< a pull that no zero error explains
constexpr double kFlicker = 1.0;       ///< brief touches per second: noise
constexpr double kHardestPress_N = 15.0;
constexpr double kDeepestPress_mm = 6.0;
constexpr const char* kSlowHost =
    "the model is fast enough, but this machine stopped the loop: see merkel doctor, and what else "
    "runs on it";
constexpr const char* kNoValue =
    "check its sensors and their wiring, and what its device names and sends";
constexpr const char* kRefused =
    "check its sensors, their units and their zeros, or increase [probe] max_force_N or max_depth_mm";

constexpr const char* kDamaged =
    "check its cable and what else is on its line or port, what it is set to send, and the options "
    "of its protocol";

double share(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

class RunChecks {
 public:
  RunChecks(const RunReport& report, const TactileModel& model)
      : report_(report), model_(model), tick_s_(units::s_from(model.parameters().tick)) {}

  std::vector<Finding> findings() {
    for (std::size_t i = 0; i < report_.probes.size(); ++i) {
      check_probe(report_.probes[i]);
      check_taxels(i);
      check_press(i);
    }
    check_loop();
    for (const RunReport::OfSink& sink : report_.sinks) check_sink(sink);
    check_stimulation();
    std::stable_sort(findings_.begin(), findings_.end(), [](const Finding& a, const Finding& b) {
      return a.severity != b.severity ? a.severity > b.severity : a.weight > b.weight;
    });
    if (findings_.size() > kMaxFindings) findings_.resize(kMaxFindings);
    return std::move(findings_);
  }

 private:
  /// \param kind  of finding: the section of tools/texts/verdict.txt that says the facts
  void add(Severity severity, double weight, std::string kind, Json facts) {
    const std::string said = filled_text("verdict", Json::object({{kind, facts}}));
    const std::size_t mark = said.rfind('|');
    facts.erase("remedy");  // a part of the whole one, which some findings replace
    findings_.push_back({severity, weight, std::move(kind), std::move(facts), said.substr(0, mark),
                         said.substr(mark + 1, said.size() - mark - 2)});
  }

  void check_probe(const RunReport::ProbeReport& probe) {
    if (!probe.uri.starts_with("sim:")) check_readings(probe);
    if (!probe.device && !probe.timing) return;  // recordings lose nothing
    check_touch(probe);
    check_samples(probe);
    if (!probe.device) return;
    check_range(probe, *probe.device);
    if (!probe.shares_device) check_device(probe, *probe.device);
  }

  void check_range(const RunReport::ProbeReport& probe, const DeviceCounts& device) {
    const auto add_count = [&](Severity severity, const char* kind, std::uint64_t count) {
      if (count == 0) return;
      add(severity, share(count, device.readings), kind, {{"uri", probe.uri}, {kind, count}});
    };
    add_count(Severity::kNote, "saturated", probe.faults.saturated);
    add_count(Severity::kLoss, "outside_calibration", probe.faults.outside_calibration);
  }

  /// A zero that should be tracked: it has a threshold of contact, and its level at rest changed.
  static bool drifts_unfollowed(const RunReport::ProbeReport& probe) {
    const double contact_mN = units::mN_from_N(probe.contact.contact_N);
    return contact_mN > 0.0 && !probe.drift.followed &&
           std::fabs(probe.drift.change_mN()) >= 0.5 * contact_mN;
  }
  static Json unfollowed(const RunReport::ProbeReport& probe) {
    return drifts_unfollowed(probe) ? drift_json(probe.drift) : Json();
  }

  void check_zero(const RunReport::ProbeReport& probe) {
    const double contact_mN = units::mN_from_N(probe.contact.contact_N);
    if (probe.drift.uncertain.count() > 0) {
      add(Severity::kNote, 1.0, "zero_uncertain",
          {{"uri", probe.uri}, {"time_s", units::s_from(probe.drift.uncertain)}});
    }
    if (probe.drift.followed && std::fabs(probe.drift.change_mN()) >= contact_mN) {
      Json facts = drift_json(probe.drift);
      facts["uri"] = probe.uri;
      add(Severity::kNote, 0.2, "zero_followed", std::move(facts));
    }
  }

  /// A wrong sign, zero or unit shows in the readings of the whole run.
  void check_readings(const RunReport::ProbeReport& probe) {
    const PressRange& range = probe.press_range;
    if (range.most_force_mN <= 0.0 && range.least_force_mN < kMisread_mN) {
      const bool deep = range.most_depth_mm > 0.1;
      add(deep ? Severity::kFailure : Severity::kNote, 1.0, "never_positive",
          {{"uri", probe.uri},
           {"least_N", units::N_from_mN(range.least_force_mN)},
           {"inverted", probe.contact.invert_force},
           {"deep", deep},
           {"most_mm", range.most_depth_mm}});
    }
    check_zero(probe);
    if (range.longest_touch >= kEndlessTouch) {
      add(Severity::kNote, 0.9, "endless",
          {{"uri", probe.uri},
           {"longest_s", units::s_from(range.longest_touch)},
           {"least_N", units::N_from_mN(range.least_force_of_longest_mN)},
           {"drift", unfollowed(probe)}});
    }
    const double run_s = static_cast<double>(report_.ticks) * tick_s_;
    if (static_cast<double>(range.brief_touches) > std::max(10.0, kFlicker * run_s)) {
      const bool by_depth =
          range.most_force_mN <= 0.0 || probe.contact.control == Indenter::Control::kDepth;
      add(Severity::kNote, 0.8, "flickered",
          {{"uri", probe.uri},
           {"touches", range.brief_touches},
           {"by_depth", by_depth},
           {"drift", unfollowed(probe)}});
    }
    const double most_N = units::N_from_mN(range.most_force_mN);
    if (most_N > kHardestPress_N || range.most_depth_mm > kDeepestPress_mm) {
      add(Severity::kNote, 0.7, "unbearable",
          {{"uri", probe.uri},
           {"most_N", std::max(most_N, 0.0)},
           {"most_mm", std::max(range.most_depth_mm, 0.0)}});
    }
  }

  void check_press(std::size_t i) {
    const RunReport::ProbeReport& probe = report_.probes[i];
    const Press& press = model_.deepest()[i];
    if (!press.touching()) return;
    const Indenter& indenter = model_.parameters().indenters[i];
    const Patch& patch = model_.parameters().patches[indenter.patch].patch;
    if (press.x_mm < 0.0 || press.x_mm > patch.length_mm || press.y_mm < 0.0 ||
        press.y_mm > patch.width_mm) {
      add(Severity::kNote, 1.0, "beside_patch",
          {{"uri", probe.uri},
           {"x_mm", press.x_mm},
           {"y_mm", press.y_mm},
           {"length_mm", patch.length_mm},
           {"width_mm", patch.width_mm}});
    }
    if (model_.sliding(i) != nullptr) return check_surface(probe, *model_.sliding(i));
    const auto both = force_and_depth(probe, model_, i);
    if (both && both->disagrees()) {
      add(Severity::kNote, 0.5, "disagree",
          {{"uri", probe.uri},
           {"force_N", both->force_N},
           {"depth_mm", both->depth_mm},
           {"model_force_N", both->model_force_N},
           {"ratio", both->ratio()},
           {"driven_by", indenter.control == Indenter::Control::kForce ? "force" : "depth"}});
    }
  }

  void check_surface(const RunReport::ProbeReport& probe, const SlidingContact& sliding) {
    const SlidingContact::Report& counts = sliding.report();
    const auto add_share = [&](Severity severity, const char* kind, double part) {
      add(severity, 1.0, kind, {{"uri", probe.uri}, {"percent", 100.0 * part}});
    };
    const double off = share(counts.off_surface, counts.solutions);
    if (off > 0.0) add_share(Severity::kNote, "off_surface", std::min(off, 1.0));
    const double cut = share(counts.cut_off, counts.solutions);
    if (cut > 0.0) add_share(Severity::kLoss, "cut_off", cut);
    if (sliding.movement_error() > kMuchMoved) {
      add(Severity::kNote, 1.0, "surface_moved",
          {{"uri", probe.uri},
           {"farthest_mm", counts.farthest_mm},
           {"percent", 100.0 * sliding.movement_error()}});
    }
    const double poor = share(counts.poor, counts.solutions);
    if (poor > kMuchPoor) add_share(Severity::kNote, "contact_off", poor);
  }

  void check_touch(const RunReport::ProbeReport& probe) {
    const double released_s = static_cast<double>(probe.counts.released_ticks) * tick_s_;
    const double outage_s =
        probe.device ? units::s_from(nanoseconds{probe.device->outage_ns}) : 0.0;
    const double run_s = static_cast<double>(report_.ticks) * tick_s_;
    const auto severity_of = [run_s](double lost_s) {
      return lost_s > kLostTouch_s || lost_s > kLostTouch * run_s ? Severity::kFailure
                                                                  : Severity::kLoss;
    };
    if (probe.device && probe.device->outages > 0 && !probe.shares_device) {
      add(severity_of(outage_s), outage_s / std::max({run_s, outage_s, 1e-9}), "unplugged",
          {{"uri", device_of(probe)}, {"outages", probe.device->outages}, {"time_s", outage_s}});
    }
    const double lost_s = released_s - outage_s;
    if (lost_s <= kShortRelease_s) return;
    const double weight = run_s > 0.0 ? lost_s / run_s : 0.0;
    const double rate_Hz = probe.timing   ? 1.0 / units::s_from(probe.timing->period)
                           : probe.device ? probe.device->rate_Hz
                                          : 0.0;
    const double refused_s =
        probe.device && rate_Hz > 0.0 ? static_cast<double>(probe.device->refused) / rate_Hz : 0.0;
    const bool refused = refused_s > 0.5 * lost_s;
    const bool no_value = refused && !probe.faults.lack.empty();
    const bool failure = severity_of(lost_s) == Severity::kFailure;
    add(severity_of(lost_s), weight, no_value ? "no_value" : (failure ? "touch_lost" : "released"),
        {{"uri", probe.uri},
         {"lost_s", lost_s},
         {"run_s", run_s},
         {"lack", probe.faults.lack},
         {"refused", refused},
         {"remedy", no_value ? kNoValue : kRefused}});
  }

  /// An array that lacks taxels and felt nothing.
  void check_taxels(std::size_t i) {
    const RunReport::ProbeReport& probe = report_.probes[i];
    const bool array = model_.parameters().indenters[i].taxels() != nullptr;
    if (!array || probe.faults.lack.empty() || probe.press_range.most_force_mN > 0.0) return;
    add(Severity::kFailure, 1.0, "felt_nothing",
        {{"uri", probe.uri}, {"lack", probe.faults.lack}, {"remedy", kNoValue}});
  }

  void check_samples(const RunReport::ProbeReport& probe) {
    const double held = share(probe.counts.held_ticks, report_.ticks);
    if (held > kMuch) {
      const auto needed = probe.timing ? probe.timing->delay : nanoseconds{0};
      const bool enough = report_.delay_measured || report_.delay >= needed;
      add(Severity::kLoss, held, "held",
          {{"uri", probe.uri},
           {"percent", 100.0 * held},
           {"period_ms", probe.timing ? Json(units::ms_from(probe.timing->period)) : Json()},
           {"needed_ms", enough ? Json() : Json(std::ceil(units::ms_from(needed)))},
           {"remedy", longer_delay()}});
    }
    const double late = share(probe.counts.late, probe.samples_in);
    if (late > kMuch) {
      add(Severity::kLoss, late, "late",
          {{"uri", probe.uri}, {"percent", 100.0 * late}, {"remedy", longer_delay()}});
    }
    if (probe.dropped > 0) {
      add(Severity::kLoss, share(probe.dropped, probe.samples_in), "dropped",
          {{"uri", probe.uri}, {"dropped", probe.dropped}});
    }
  }

  /// The remedy for samples that come too late, depending on what limited the delay.
  [[nodiscard]] std::string longer_delay() const {
    if (!report_.delay_measured) {
      return "increase [probe] delay_ms, or remove the key: the delay is then measured";
    }
    if (report_.delay_ceiling.count() > 0) {
      return fmt::format("let the device send more evenly, or set [probe] max_delay_ms above {}",
                         number_text(units::ms_from(report_.delay_ceiling)));
    }
    return "let the device send more evenly, and check with merkel doctor what else loads this "
           "machine";
  }

  /// The URI of its device, which may feed other probes.
  static std::string device_of(const RunReport::ProbeReport& probe) {
    return split_fragment(probe.uri).first;
  }

  void check_device(const RunReport::ProbeReport& probe, const DeviceCounts& device) {
    const std::string uri = device_of(probe);
    const std::uint64_t wrong = device.lost + device.damaged + device.refused;
    if (wrong > 0) {
      add(Severity::kLoss, share(wrong, device.readings + wrong), "lost",
          {{"uri", uri},
           {"lost", device.lost},
           {"damaged", device.damaged},
           {"refused", device.refused},
           {"sent", device.unexpected},
           {"remedy", device.lost + device.damaged == 0 ? kRefused : kDamaged}});
    }
    if (device.distrusted > 0) {
      add(Severity::kLoss, share(device.withheld, device.readings + device.withheld), "distrusted",
          {{"uri", uri},
           {"distrusted", device.distrusted},
           {"withheld", device.withheld},
           {"sent", wrong > 0 ? "" : device.unexpected},
           {"remedy", kDamaged}});
    }
    if (device.age_ms > kOld_ms) {
      add(Severity::kLoss, 1.0, "bursts",  // of all samples: the cause of held and released ticks
          {{"uri", uri},
           {"largest_batch", device.largest_batch},
           {"age_ms", device.age_ms},
           {"tcp", uri.starts_with("tcp:")}});
    }
    if (device.clock_mistrusted) {
      add(Severity::kLoss, 0.0, "clock_mistrusted",
          {{"uri", uri}, {"clock_rate", device.clock_rate}});
    }
  }

  void check_loop() {
    const std::uint64_t all = report_.ticks + report_.skipped_ticks;
    const std::string remedy = model_is_slow() ? slow_model() : kSlowHost;
    if (report_.skipped_ticks > 0) {
      const double skipped = share(report_.skipped_ticks, all);
      add(skipped > kMuch ? Severity::kFailure : Severity::kLoss, skipped, "skipped",
          {{"skipped", report_.skipped_ticks}, {"all", all}, {"remedy", remedy}});
    }
    if (report_.demotions > 0)
      add(Severity::kFailure, 0.0, "demoted", Json::object({{"demotions", report_.demotions}}));
    if (report_.neuron_resets + report_.spikes_refused > 0) {
      add(Severity::kFailure, 1.0, "unstable",
          {{"resets", report_.neuron_resets},
           {"refused", report_.spikes_refused},
           {"energy", model_.parameters().energy_driven()}});
    }
    if (report_.overruns > 0) {
      add(Severity::kLoss, share(report_.overruns, all), "overran",
          {{"overruns", report_.overruns},
           {"longest_ms", 1e-6 * static_cast<double>(report_.longest_overrun_ns)},
           {"remedy", remedy}});
    }
  }

  /// Whether more than rare ticks use a processor for longer than they last, and most late ticks
  /// are late because of that.
  [[nodiscard]] bool model_is_slow() const {
    return report_.host_time && report_.host_time->processor.p99 > model_.parameters().tick &&
           report_.overruns_by_long_compute >= report_.overruns_by_late_wake_up;
  }
  [[nodiscard]] std::string slow_model() const {
    return fmt::format(
        "simplify the scene (merkel plan): 1 % of its ticks compute for over {} ms, and a "
        "tick lasts {} ms",
        number_text(units::ms_from(report_.host_time->processor.p99)), number_text(1e3 * tick_s_));
  }

  void check_sink(const RunReport::OfSink& sink) {
    if (!sink.error_message.empty()) {
      add(Severity::kFailure, 1.0, "sink_failed",
          {{"uri", sink.uri}, {"reason", sink.error_message}});
      return;
    }
    if (sink.commands_refused > 0) {
      const double refused = share(sink.commands_refused, sink.commands_in);
      add(refused > kMuch ? Severity::kFailure : Severity::kLoss, refused, "commands_refused",
          {{"uri", sink.uri}, {"refused", sink.commands_refused}, {"all", sink.commands_in}});
    }
    const std::uint64_t missing = sink.dropped + sink.lost();
    if (missing > 0) {
      add(Severity::kFailure, share(missing, sink.spikes_in), "spikes_missing",
          {{"uri", sink.uri}, {"missing", missing}, {"all", sink.spikes_in}});
    }
  }

  void check_stimulation() {
    if (report_.stimulation_stop.by != StimulationSwitch::By::kNone) {
      add(Severity::kNote, 1.0, "stopped",
          {{"by", name_of(report_.stimulation_stop.by)},
           {"time_s", units::s_from(report_.stimulation_stop.at)},
           {"off", report_.stimulation_stopped != StimulationSwitch::By::kNone}});
    }
    if (report_.commands_dropped == 0) return;
    add(Severity::kFailure, share(report_.commands_dropped, report_.commands), "commands_lost",
        {{"dropped", report_.commands_dropped}, {"all", report_.commands}});
  }

  const RunReport& report_;
  const TactileModel& model_;
  double tick_s_;
  std::vector<Finding> findings_;
};

std::string_view name_of(Severity severity) {
  switch (severity) {
    case Severity::kNote:
      return "note";
    case Severity::kLoss:
      return "loss";
    case Severity::kFailure:
      return "failure";
  }
  return "";
}

}  // namespace

std::vector<Finding> verdict_of(const RunReport& report, const TactileModel& model) {
  return RunChecks(report, model).findings();
}

std::string findings_text(const std::vector<Finding>& findings) {
  if (findings.empty()) return "ok";
  std::string text;
  for (const Finding& finding : findings) {
    text.append(text.empty() ? "" : "; ").append(finding.sentence).append(": ");
    text.append(finding.remedy);
  }
  return text;
}

Json verdict_json(const std::vector<Finding>& findings) {
  auto list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"severity", name_of(finding.severity)},
                    {"kind", finding.kind},
                    {"facts", finding.facts},
                    {"finding", finding.sentence},
                    {"remedy", finding.remedy}});
  }
  return list;
}

bool failed(const std::vector<Finding>& findings, bool strict) {
  return std::any_of(findings.begin(), findings.end(), [strict](const Finding& finding) {
    return finding.severity == Severity::kFailure ||
           (strict && finding.severity == Severity::kLoss);
  });
}

}  // namespace merkel
