#include "tools/run/verdict.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/json_text.hpp"
#include "tools/number_text.hpp"
#include "tools/run/endless_touch.hpp"
#include "tools/run/force_and_depth.hpp"

namespace merkel {
namespace {

using Severity = Finding::Severity;
using std::chrono::nanoseconds;

constexpr std::size_t kMaxFindings = 5;
constexpr double kMuchPoor = 0.2;     ///< share of solutions
constexpr double kMuchMoved = 0.02;   ///< of the largest energy density
constexpr double kOld_ms = 50.0;      ///< mean age at arrival: bursts
constexpr double kMuch = 0.01;        ///< share of ticks or samples that is reported
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
    "check the units and the zero, or increase [probe] max_force_N or max_depth_mm";

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
  void add(Severity severity, double weight, std::string what, std::string remedy) {
    findings_.push_back({severity, weight, std::move(what), std::move(remedy)});
  }

  void check_probe(const RunReport::ProbeReport& probe) {
    if (!probe.uri.starts_with("sim:")) check_readings(probe);
    if (!probe.device && !probe.timing) return;  // recordings lose nothing
    check_touch(probe);
    check_samples(probe);
    if (probe.device && !probe.shares_device) check_device(probe, *probe.device);
  }

  /// "20 mN in 120 s (0.17 mN/s)"
  static std::string drift_text(const ContactDecision::Drift& drift) {
    const double time_s = units::s_from(drift.last - drift.first);
    return fmt::format("{:.3g} mN in {:.3g} s ({:.2g} mN/s)", std::fabs(drift.change_mN()), time_s,
                       std::fabs(drift.change_mN()) / std::max(time_s, 1e-9));
  }
  /// A zero that should be tracked: it has a threshold of contact, and its level at rest changed.
  static bool drifts_unfollowed(const RunReport::ProbeReport& probe) {
    const double contact_mN = units::mN_from_N(probe.contact.contact_N);
    return contact_mN > 0.0 && !probe.drift.followed &&
           std::fabs(probe.drift.change_mN()) >= 0.5 * contact_mN;
  }
  static std::string rest_of(const RunReport::ProbeReport& probe) {
    if (!drifts_unfollowed(probe)) return {};
    return "; its zero drifted by " + drift_text(probe.drift);
  }

  void check_zero(const RunReport::ProbeReport& probe) {
    const double contact_mN = units::mN_from_N(probe.contact.contact_N);
    if (probe.drift.uncertain.count() > 0) {
      add(Severity::kNote, 1.0,
          fmt::format("the zero of {} was uncertain for {} s: its contact may have been drift, and "
                      "stimulation was suspended",
                      probe.uri, number_text(units::s_from(probe.drift.uncertain))),
          "lift the probe and tare it (in the live page); if it drifts, let it warm up, and set "
          "[probe] zero_drift_mN_per_s to two to three times the drift that merkel connect measures");
    }
    if (probe.drift.followed && std::fabs(probe.drift.change_mN()) >= contact_mN) {
      add(Severity::kNote, 0.2,
          fmt::format("the zero of {} drifted by {}, and was followed", probe.uri,
                      drift_text(probe.drift)),
          "let the sensor warm up before a long hold, during which its zero cannot be followed");
    }
  }

  /// A wrong sign, zero or unit shows in the readings of the whole run.
  void check_readings(const RunReport::ProbeReport& probe) {
    const PressRange& range = probe.press_range;
    const double least_N = units::N_from_mN(range.least_force_mN);
    if (range.most_force_mN <= 0.0 && range.least_force_mN < kMisread_mN) {
      const bool deep = range.most_depth_mm > 0.1;
      add(deep ? Severity::kFailure : Severity::kNote, 1.0,
          fmt::format(
              "the force of {} was never positive: it went down to {} N{}", probe.uri,
              number_text(least_N),
              deep ? ", while the depth reached " + number_text(range.most_depth_mm) + " mm" : ""),
          "if the sensor reports compression as negative, set [probe] invert_force = true; otherwise "
          "tare it");
    }
    check_zero(probe);
    const double longest_s = units::s_from(range.longest_touch);
    if (range.longest_touch >= kEndlessTouch) {
      add(Severity::kNote, 0.9,
          fmt::format("the contact of {} did not end for {} s; its smallest force was {} N{}",
                      probe.uri, number_text(longest_s),
                      number_text(units::N_from_mN(range.least_force_of_longest_mN)),
                      rest_of(probe)),
          std::string("if the probe was free, tare it (in the live page, or with merkel "
                      "calibrate), ") +
              (drifts_unfollowed(probe) ? "and set [probe] zero = \"track\""
                                        : "or set [probe] contact_N above its offset"));
    }
    const double run_s = static_cast<double>(report_.ticks) * tick_s_;
    if (static_cast<double>(range.brief_touches) > std::max(10.0, kFlicker * run_s)) {
      const bool by_depth =
          range.most_force_mN <= 0.0 || probe.contact.control == Indenter::Control::kDepth;
      add(Severity::kNote, 0.8,
          fmt::format("the contact of {} flickered: {} ended within 15 ms{}", probe.uri,
                      std::to_string(range.brief_touches) + " touches", rest_of(probe)),
          drifts_unfollowed(probe)
              ? "set [probe] zero = \"track\", with contact_N several times the noise of the "
                "sensor at rest"
              : fmt::format("set [probe] {} to several times the noise of the sensor at rest",
                            by_depth ? "contact_mm" : "contact_N"));
    }
    const double most_N = units::N_from_mN(range.most_force_mN);
    if (most_N > kHardestPress_N || range.most_depth_mm > kDeepestPress_mm) {
      std::string what = most_N > 0.0 ? number_text(most_N) + " N" : "";
      if (range.most_depth_mm > 0.0) {
        what += (what.empty() ? "" : " and ") + number_text(range.most_depth_mm) + " mm";
      }
      add(Severity::kNote, 0.7, probe.uri + " reported " + what + ", which no finger bears",
          "check the units of its columns and its calibration");
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
      add(Severity::kNote, 1.0,
          fmt::format("{} pressed at ({:.4g}, {:.4g}) mm, outside the patch of {:.4g} x {:.4g} mm",
                      probe.uri, press.x_mm, press.y_mm, patch.length_mm, patch.width_mm),
          "set the stage's zero to the fingertip, the origin of the patch, or set [probe] x_mm, "
          "y_mm");
    }
    if (model_.sliding(i) != nullptr) return check_surface(probe, *model_.sliding(i));
    const auto both = force_and_depth(probe, model_, i);
    if (both && both->disagrees()) {
      const bool by_force = indenter.control == Indenter::Control::kForce;
      add(Severity::kNote, 0.5,
          fmt::format(
              "{} measured {:.4g} N at {:.4g} mm, where the model's skin gives {:.4g} N: ratio {:.2f}",
              probe.uri, both->force_N, both->depth_mm, both->model_force_N, both->ratio()),
          std::string(
              "check the zero of its depth, [probe] radius_mm and the skin's moduli; its ") +
              (by_force ? "force" : "depth") + " drives the model ([probe] control)");
    }
  }

  void check_surface(const RunReport::ProbeReport& probe, const SlidingContact& sliding) {
    const SlidingContact::Report& counts = sliding.report();
    const double off = share(counts.off_surface, counts.solutions);
    if (off > 0.0) {
      add(Severity::kNote, 1.0,
          fmt::format("the surface of {} was too small for its path: the finger's apex was beyond "
                      "its end in {} % of the contact",
                      probe.uri, number_text(100.0 * std::min(off, 1.0))),
          "let it repeat by [probe] period_x_mm and period_y_mm, or shorten the path");
    }
    const double cut = share(counts.cut_off, counts.solutions);
    if (cut > 0.0) {
      add(Severity::kLoss, 1.0,
          fmt::format("the surface of {} touched more skin than its contact has room for, in {} % "
                      "of the contact",
                      probe.uri, number_text(100.0 * cut)),
          "increase [probe] deepest_mm, or press less");
    }
    if (sliding.movement_error() > kMuchMoved) {
      add(Severity::kNote, 1.0,
          fmt::format("the surface of {} moved by up to {:.2g} mm between two solutions of its "
                      "contact: energy densities are off by up to about {:.2g} % of the largest",
                      probe.uri, counts.farthest_mm, 100.0 * sliding.movement_error()),
          "slide more slowly, or make [probe] deepest_mm smaller, so that it is solved more often");
    }
    const double poor = share(counts.poor, counts.solutions);
    if (poor > kMuchPoor) {
      add(Severity::kNote, 1.0,
          fmt::format("the contact of {} was off by more than 1 % of its depth in {} % of the "
                      "solutions",
                      probe.uri, number_text(100.0 * poor)),
          "slide or press more slowly");
    }
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
      const std::uint64_t outages = probe.device->outages;
      add(severity_of(outage_s), outage_s / std::max({run_s, outage_s, 1e-9}),
          fmt::format("{} was unplugged {}, for {} s{}", probe.uri,
                      outages == 1 ? "once" : counted(outages, "time"), number_text(outage_s),
                      outages == 1 ? "" : " in total"),
          "check its cable and plug");
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
    if (refused && !probe.lack.empty()) {
      add(severity_of(lost_s), weight,
          fmt::format("{} was released for {} s of {}: {}", probe.uri, number_text(lost_s),
                      number_text(run_s), probe.lack),
          kNoValue);
      return;
    }
    if (severity_of(lost_s) == Severity::kFailure) {
      add(Severity::kFailure, weight,
          fmt::format("touch was lost for {} s of {}: ", number_text(lost_s), number_text(run_s)) +
              (refused ? "the readings of " + probe.uri + " were refused"
                       : "no sample of " + probe.uri + " arrived in time"),
          refused ? kRefused
                  : "keep the device streaming, and look for the cause in the clock and delay "
                    "lines of the summary");
    } else {
      add(Severity::kLoss, weight,
          fmt::format("{} was released for {} s: {}", probe.uri, number_text(lost_s),
                      refused ? "its readings were refused" : "no sample arrived in time"),
          refused ? kRefused : "keep the device streaming, or increase [loop] stale_after_ms");
    }
  }

  /// An array that lacks taxels and felt nothing.
  void check_taxels(std::size_t i) {
    const RunReport::ProbeReport& probe = report_.probes[i];
    const bool array = model_.parameters().indenters[i].taxels() != nullptr;
    if (!array || probe.lack.empty() || probe.press_range.most_force_mN > 0.0) return;
    add(Severity::kFailure, 1.0, fmt::format("{} felt no touch: {}", probe.uri, probe.lack),
        kNoValue);
  }

  void check_samples(const RunReport::ProbeReport& probe) {
    const double held = share(probe.counts.held_ticks, report_.ticks);
    if (held > kMuch) {
      const auto needed = probe.timing ? probe.timing->delay : nanoseconds{0};
      const double period_ms = probe.timing ? units::ms_from(probe.timing->period) : 0.0;
      std::string what =
          fmt::format("{:.0f} % of ticks held the last sample of {}", 100.0 * held, probe.uri);
      if (probe.timing) what += ", which sends one every " + number_text(period_ms) + " ms";
      add(Severity::kLoss, held, what,
          report_.delay_measured || report_.delay >= needed
              ? "its samples arrive irregularly: " + longer_delay()
              : fmt::format(
                    "set [probe] delay_ms = {:.0f}, or remove the key: the delay is then measured",
                    std::ceil(units::ms_from(needed))));
    }
    const double late = share(probe.counts.late, probe.samples_in);
    if (late > kMuch) {
      add(Severity::kLoss, late,
          fmt::format("{:.0f} % of the samples of {} arrived after their time had been simulated",
                      100.0 * late, probe.uri),
          longer_delay());
    }
    if (probe.dropped > 0) {
      add(Severity::kLoss, share(probe.dropped, probe.samples_in),
          fmt::format("{} of {} {} dropped: the simulation did not keep up",
                      counted(probe.dropped, "sample"), probe.uri, was(probe.dropped)),
          "simplify the scene: see merkel plan");
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

  void check_device(const RunReport::ProbeReport& probe, const DeviceCounts& device) {
    const std::string sent =
        device.unexpected.empty() ? "" : "; the first answer that was wrong: " + device.unexpected;
    const std::uint64_t wrong = device.lost + device.damaged + device.refused;
    if (wrong > 0) {
      add(Severity::kLoss, share(wrong, device.readings + wrong),
          fmt::format("{}: {} {} lost, {} damaged and {} refused{}", probe.uri,
                      counted(device.lost, "reading"), was(device.lost), device.damaged,
                      device.refused, sent),
          device.lost + device.damaged == 0 ? kRefused : kDamaged);
    }
    if (device.distrusted > 0) {
      add(Severity::kLoss, share(device.withheld, device.readings + device.withheld),
          fmt::format("most of what {} sent was damaged, {} times: its press was released, {} "
                      "readings were not used{}",
                      probe.uri, device.distrusted, device.withheld, wrong > 0 ? "" : sent),
          kDamaged);
    }
    if (device.age_ms > kOld_ms) {
      add(Severity::kLoss, 0.0,
          fmt::format("the samples of {} arrive in bursts of up to {}: they are {:.0f} ms old on "
                      "average, which delays the spikes",
                      probe.uri, device.largest_batch, device.age_ms),
          probe.uri.starts_with("tcp:")
              ? "set TCP_NODELAY at the sender, and the packing time of a serial server to 0"
              : "send each sample at once (flush after every line), and set the latency timer of "
                "an FTDI adapter to 1 ms");
    }
    if (device.clock_mistrusted) {
      add(Severity::kLoss, 0.0,
          fmt::format(
              "the clock of {} runs at {:.4g} times the rate of this machine's, so samples are "
              "timed by their arrival",
              probe.uri, device.clock_rate),
          "check the unit of its time column (time_s, time_ms or time_us), or set clock=arrival");
    }
    if (device.saturated > 0) {
      add(Severity::kNote, share(device.saturated, device.readings),
          fmt::format("{} of {} {} at the end of its range", counted(device.saturated, "reading"),
                      probe.uri, was(device.saturated)),
          "press less, or use a sensor with a larger range");
    }
    if (device.outside_calibration > 0) {
      add(Severity::kLoss, share(device.outside_calibration, device.readings),
          fmt::format("{} of {} {} outside the range of the calibration",
                      counted(device.outside_calibration, "reading"), probe.uri,
                      was(device.outside_calibration)),
          "calibrate with points as large as the presses (merkel calibrate --overwrite), or press "
          "less");
    }
  }

  void check_loop() {
    const std::uint64_t all = report_.ticks + report_.skipped_ticks;
    if (report_.skipped_ticks > 0) {
      const double skipped = share(report_.skipped_ticks, all);
      add(skipped > kMuch ? Severity::kFailure : Severity::kLoss, skipped,
          fmt::format("{} of {} {} skipped: the simulation fell behind", report_.skipped_ticks,
                      counted(all, "tick"), was(report_.skipped_ticks)),
          model_is_slow() ? slow_model() : kSlowHost);
    }
    if (report_.demotions > 0) {
      add(Severity::kFailure, 0.0,
          "the simulation was demoted to SCHED_OTHER: it left no time for other programs",
          "simplify the scene, or use fewer threads");
    }
    if (report_.overruns > 0) {
      add(Severity::kLoss, share(report_.overruns, all),
          fmt::format("{} ended late, the longest by {} ms", counted(report_.overruns, "tick"),
                      number_text(1e-6 * static_cast<double>(report_.longest_overrun_ns))),
          model_is_slow() ? slow_model() : kSlowHost);
    }
  }

  /// Whether more than rare ticks took longer than they last. Rare ones are stopped by the host.
  [[nodiscard]] bool model_is_slow() const {
    return report_.host_time && report_.host_time->tick.p99 > model_.parameters().tick;
  }
  [[nodiscard]] std::string slow_model() const {
    return fmt::format(
        "simplify the scene (merkel plan): 1 % of its ticks took over {} ms, and a "
        "tick lasts {} ms",
        number_text(units::ms_from(report_.host_time->tick.p99)), number_text(1e3 * tick_s_));
  }

  void check_sink(const RunReport::OfSink& sink) {
    if (!sink.error_message.empty()) {
      add(Severity::kFailure, 1.0, fmt::format("{} failed: {}", sink.uri, sink.error_message),
          "fix the cause and run again; the spikes before the failure were delivered");
      return;
    }
    const std::uint64_t missing = sink.dropped + sink.lost();
    if (missing > 0) {
      add(Severity::kFailure, share(missing, sink.spikes_in),
          fmt::format("{} of {} did not reach {}", missing, counted(sink.spikes_in, "spike"),
                      sink.uri),
          "make the receiver faster, or also record a session (xdf:FILE)");
    }
  }

  void check_stimulation() {
    if (report_.stimulation_stop.by != StimulationSwitch::By::kNone) {
      const bool off = report_.stimulation_stopped != StimulationSwitch::By::kNone;
      add(Severity::kNote, 1.0,
          fmt::format("stimulation was stopped by {} after {} s{}",
                      name_of(report_.stimulation_stop.by),
                      number_text(units::s_from(report_.stimulation_stop.at)),
                      off ? ", until the end of the run" : ", and started again"),
          "none: the stop was asked for");
    }
    if (report_.commands_dropped == 0) return;
    add(Severity::kFailure, share(report_.commands_dropped, report_.commands),
        fmt::format("{} of {} {} lost, so stimulation was stopped", report_.commands_dropped,
                    counted(report_.commands, "stimulation command"),
                    was(report_.commands_dropped)),
        "make the receiver of the command sink faster");
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
