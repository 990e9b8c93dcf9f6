#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/expected.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// Latency and losses of spikes on the way to one kind of consumer.
struct ConsumerLatency {
  const char* name = "";              ///< for display
  const char* key = "";               ///< in JSON
  std::chrono::nanoseconds good{};    ///< the largest good median of `software`
  std::uint64_t spikes = 0;           ///< received
  std::uint64_t missing = 0;          ///< not received
  std::uint64_t unmatched = 0;        ///< received, of ticks whose times are not known
  LatencySummary sink;                ///< published → received
  LatencySummary software;            ///< tick due → received
  LatencySummary sample_to_received;  ///< sample arrived → received
};

/// A measurement of the whole path: a live simulated probe, the paper's fingertip, and consumers.
struct PathMeasurement {
  RunReport report;
  /// A consumer that polls its queue at the publishing rate, and a subscriber of the zmq: sink.
  std::vector<ConsumerLatency> consumers = {};
  std::chrono::nanoseconds steal{0};  ///< time that the hypervisor kept cores from this host

  /// Ticks that were not done when the next one was due, plus skipped ticks.
  [[nodiscard]] std::uint64_t missed() const noexcept {
    return report.overruns + report.skipped_ticks;
  }
  [[nodiscard]] double missed_fraction() const noexcept;
};

struct PathSettings {
  std::chrono::nanoseconds duration{10'000'000'000};
  std::chrono::nanoseconds tick{1'000'000};
  bool page = false;  ///< also the live page, with browsers that read nothing
  LoopWait wait = LoopWait::kHybrid;
  RealtimeSettings realtime;
};

/// Runs the path in real time. \param started  called with the pipeline before the run and with
/// null after it
[[nodiscard]] Expected<PathMeasurement, SetupError> measure_path(
    const PathSettings& settings, const std::function<void(const RunProgress&)>& on_progress,
    const std::function<void(Pipeline*)>& started);

}  // namespace merkel
