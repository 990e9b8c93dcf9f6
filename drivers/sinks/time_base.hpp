#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sink.hpp"
#include "drivers/sink_setup.hpp"
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
  [[nodiscard]] const RunOrigin& origin() const noexcept { return origin_; }

  /// Converts a probe time to a time in the file.
  [[nodiscard]] std::chrono::nanoseconds operator()(std::chrono::nanoseconds time) const noexcept {
    return time - offset_;
  }

  /// The same in seconds or milliseconds, as the double next to the nanosecond.
  [[nodiscard]] double s(std::chrono::nanoseconds time) const noexcept {
    return nearest((*this)(time).count(), 1'000'000'000);
  }
  [[nodiscard]] double ms(std::chrono::nanoseconds time) const noexcept {
    return nearest((*this)(time).count(), 1'000'000);
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
  [[nodiscard]] static double nearest(std::int64_t count, std::int64_t per) noexcept {
    // A count beyond 2^53, such as one since 1970, is not a double: its parts are.
    constexpr std::int64_t kExact = std::int64_t{1} << 53U;
    if (count > -kExact && count < kExact) {
      return static_cast<double>(count) / static_cast<double>(per);
    }
    const std::int64_t whole = count / per;
    return static_cast<double>(whole) + static_cast<double>(count % per) / static_cast<double>(per);
  }

  TimeZero zero_;
  RunOrigin origin_;
  std::chrono::nanoseconds offset_{0};
};

}  // namespace merkel
