#pragma once

#include <optional>
#include <string>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/probes/host_clock.hpp"
#include "realtime/queues/latency_histogram.hpp"
#include "tools/connect/rest_drift.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// How a device keeps time, and the drift of its sensor while nothing touches it.
struct ProbeReport {
  bool force = false;  ///< the drift is that of a force, else of a depth
  RestDrift drift;
  LatencySummary reads;  ///< processor time of each read that brought readings
  std::optional<SampleTiming> timing;
  std::optional<DeviceCounts> device;

  /// Reads a probe for some seconds, or until the user interrupts (measure_rest()).
  [[nodiscard]] static Expected<ProbeReport, SetupError> measure(
      Probe& probe, double seconds, HostClock& clock = HostClock::real());
  /// Lines of text: rate and jitter, the device's counters, processor time, drift.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] Json json() const;
};

}  // namespace merkel
