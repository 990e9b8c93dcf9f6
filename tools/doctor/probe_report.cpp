#include "tools/doctor/probe_report.hpp"

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/filled_text.hpp"
#include "tools/run/device_summary.hpp"
#include "tools/run/loop_summary.hpp"

namespace merkel {

Expected<ProbeReport, SetupError> ProbeReport::measure(Probe& probe, double seconds,
                                                       HostClock& clock) {
  LatencyHistogram reads;
  auto drift = measure_rest(probe, seconds, &reads, clock);
  if (!drift) return Unexpected<SetupError>(drift.error());
  ProbeStatus status = probe.status();
  return ProbeReport{.force = (probe.info().channels & ProbeSample::kForce) != 0U,
                     .drift = std::move(*drift),
                     .reads = LatencySummary::of(reads.snapshot()),
                     .timing = status.timing,
                     .device = std::move(status.device)};
}

std::string ProbeReport::text() const {
  std::string text = timing ? filled_text("timing", timing_json(*timing))
                            : "rate: too few samples to measure it\n";
  if (device) text += filled_text("device", device_json(device));
  return text + fmt::format("{} reads that brought samples, processor time of each: {}\n{}\n",
                            reads.count, latency_text(reads), drift_text(drift, force));
}

Json ProbeReport::json() const {
  const double scale = force ? units::mN_from_N(1.0) : 1.0;
  const std::string unit = force ? "mN" : "mm";
  const auto slope = drift.slope();
  Json json = {{"seconds", drift.seconds()},
               {"device", device_json(device)},
               {"read", latency_json(reads)},
               {"drift_" + unit + "_per_s", slope ? Json(*slope * scale) : Json()},
               {"largest_" + unit + "_per_s", drift.largest_slope() * scale},
               {"noise_" + unit, drift.noise() * scale},
               {"warmed_up", drift.is_warm()}};
  if (timing) {
    json["rate_hz"] = 1e3 / units::ms_from(timing->period);
    json["jitter_ms"] = units::ms_from(timing->jitter);
  }
  return json;
}

}  // namespace merkel
