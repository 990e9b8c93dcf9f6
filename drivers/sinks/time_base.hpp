#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sink.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// The zero of the times in a file: the option `time` of every file sink.
class TimeBase {
 public:
  explicit TimeBase(TimeZero zero) : zero_(zero) {}
  /// Reads the option `time=run|unix|device`.
  [[nodiscard]] static TimeBase read(UriOptions& options, const SinkSetup& setup);

  /// Sets the run's origin.
  void set(const RunOrigin& origin) noexcept;

  /// Converts a probe time to a time in the file.
  [[nodiscard]] std::chrono::nanoseconds operator()(std::chrono::nanoseconds time) const noexcept {
    return time - offset_;
  }

  /// Facts that convert a file's times back: `time_zero` (run, unix or device),
  /// `time_offset_ns` (probe time = time in the file + offset), `start_device_ns` and, if known,
  /// `start_utc_ns` of the run.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> facts() const;

  /// Probe time − time in the file.
  [[nodiscard]] std::chrono::nanoseconds offset() const noexcept { return offset_; }
  /// Whether the file's times are probe times, so no conversion is stored.
  [[nodiscard]] bool plain() const noexcept { return offset_.count() == 0; }

 private:
  TimeZero zero_;
  RunOrigin origin_;
  std::chrono::nanoseconds offset_{0};
};

}  // namespace merkel
