#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/expected.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// What spikes suffered on their way to one kind of consumer.
struct ConsumerLatency {
  const char* name = "";           ///< for people
  const char* key = "";            ///< in JSON
  std::uint64_t spikes = 0;        ///< that it got
  std::uint64_t missing = 0;       ///< that it did not
  LatencySummary sink;             ///< published → in hand
  LatencySummary software;         ///< tick due → in hand
  LatencySummary sample_to_spike;  ///< sample arrived → in hand
};

/// The whole path measured: a live simulated probe, the paper's fingertip, and its consumers.
struct PathMeasurement {
  RunReport report;
  /// One that polls its queue on the publishing beat, and one that receives datagrams on loopback
  /// or subscribes to the zmq: sink.
  std::vector<ConsumerLatency> consumers;
  std::chrono::nanoseconds steal{0};  ///< the hypervisor's: time it kept a core from this host

  /// Ticks that were not done when the next was due, or left out; of all.
  [[nodiscard]] std::uint64_t missed() const noexcept {
    return report.overruns + report.skipped_ticks;
  }
  [[nodiscard]] double missed_fraction() const noexcept;
};

struct PathSettings {
  std::chrono::nanoseconds duration{10'000'000'000};
  std::chrono::nanoseconds tick{1'000'000};
  bool zeromq = false;  ///< a ZeroMQ subscriber in place of the UDP consumer
  bool page = false;    ///< the live page too, with browsers that hang
  LoopWait wait = LoopWait::kHybrid;
  RealtimeSettings realtime;
};

/// Runs the path in real time. \param started  called with the pipeline before it runs, null after
[[nodiscard]] Expected<PathMeasurement, SetupError> measure_path(
    const PathSettings& settings, const std::function<void(const RunProgress&)>& on_progress,
    const std::function<void(Pipeline*)>& started);

}  // namespace merkel
