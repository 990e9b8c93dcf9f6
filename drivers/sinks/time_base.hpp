#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sinks/sink_setup.hpp"
#include "drivers/spike_sink.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// What the times in a file are counted from: the option `time` of every file sink.
class TimeBase {
 public:
  explicit TimeBase(TimeZero zero) : zero_(zero) {}
  /// Reads the option `time=run|unix|device`.
  [[nodiscard]] static TimeBase read(UriOptions& options, const SinkSetup& setup);

  /// The run's origin, once it is known.
  void set(const RunOrigin& origin) noexcept;

  /// A probe time as it stands in the file.
  [[nodiscard]] std::chrono::nanoseconds operator()(std::chrono::nanoseconds time) const noexcept {
    return time - offset_;
  }

  /// Names and values that turn a file's times back: `time_zero` (run, unix or device),
  /// `time_offset_ns` (probe time = time in the file + offset), `start_device_ns` and, where it is
  /// known, `start_utc_ns` of the run.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> facts() const;

  /// Whether the file's times are those of the probe, so that nothing need be noted.
  [[nodiscard]] bool plain() const noexcept { return offset_.count() == 0; }

 private:
  TimeZero zero_;
  RunOrigin origin_;
  std::chrono::nanoseconds offset_{0};
};

}  // namespace merkel
