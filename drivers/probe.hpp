#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "core/records/device_counters.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/raw_frame.hpp"
#include "core/records/readings.hpp"

namespace merkel {

struct ProbeCalibration;

/// Why a probe delivers no more samples.
enum class ProbeError {
  kEndOfStream,  ///< normal end of a recording or a simulated press
  kBadData,      ///< a recording is unreadable; error_message() contains place and reason
  kDisconnected  ///< a device is permanently lost; error_message() contains the reason
};

/// The run in which a recording was made, in the recording's own time.
struct RecordedRun {
  std::chrono::nanoseconds start{0};  ///< where its first tick began: a replay has the same ticks
  std::chrono::nanoseconds zero{0};   ///< from which the times in files are counted
  std::chrono::nanoseconds utc{0};    ///< the instant of `zero` since 1970-01-01; 0: not known
};

/// The description of a probe.
struct ProbeInfo {
  std::string uri;             ///< as the user gave it
  std::string name;            ///< for display
  std::string serial_number;   ///< of the device; empty for recordings
  std::uint32_t channels = 0;  ///< ProbeSample::Channel bits that every sample carries
  std::optional<std::chrono::nanoseconds> period;  ///< nominal sample period, if known
  /// True for a recording or simulation: it has its own time base, and it waits until its samples
  /// are read. False for a device: its times are host-monotonic, and samples that do not fit are
  /// dropped.
  bool replayed = false;
  std::string calibration_file = {};  ///< as the user gave it; empty for none
  std::uint32_t calibrated = 0;       ///< ProbeSample::Channel bits that this file calibrates
  std::string calibration = {};       ///< in force, as the text of such a file; of a device only
  std::vector<std::string> extra_columns = {};  ///< names of its further columns, in order
  /// All channels of a device with names of their own, more than extra_columns can be.
  std::vector<std::string> device_channels = {};
  std::optional<RecordedRun> run = {};  ///< of a recording, if known
  std::size_t taxels = 0;               ///< of a tactile array; 0: another probe

  /// Its name or, without one, its URI.
  [[nodiscard]] const std::string& title() const noexcept { return name.empty() ? uri : name; }
};

/// The columns of a probe, and of a device that feeds some.
[[nodiscard]] inline ProbeColumns columns_of(const ProbeInfo& probe) {
  return {.further = probe.extra_columns.size(), .taxels = probe.taxels};
}
[[nodiscard]] inline ReadingColumns columns_of(std::span<const ProbeInfo> probes) {
  std::vector<ProbeColumns> all;
  for (const ProbeInfo& each : probes) all.push_back(columns_of(each));
  return ReadingColumns(std::move(all));
}

/// What a device's driver counts and measures.
struct DeviceCounts : DeviceCounters {
  std::string port;                      ///< how the device was opened
  double rate_Hz = 0.0;                  ///< measured readings per second
  double age_ms = 0.0;                   ///< mean age of a sample when it arrives
  bool device_clock = false;             ///< sample times come from the device's clock
  double drift_ppm = 0.0;                ///< of that clock
  double jitter_us = 0.0;                ///< of the mapped times
  double latency_us = 0.0;               ///< mean of arrival after the mapped time
  std::optional<double> uncertainty_us;  ///< of the sample times, if known
  double clock_rate = 1.0;               ///< device seconds per host second
  bool clock_mistrusted = false;         ///< its rate is wrong: arrival times are used
  /// Its first answer that was not as expected, quoted, and what was expected; empty: none.
  std::string unexpected;
};

/// The measured period, jitter and delay of a device's samples.
struct SampleTiming {
  std::chrono::nanoseconds period{0};
  std::chrono::nanoseconds jitter{0};  ///< 99.9 % quantile of the lateness of arrivals
  /// After this delay, the samples before and after a given time have arrived.
  std::chrono::nanoseconds delay{0};
  /// After this delay, the samples before a given time have arrived.
  std::chrono::nanoseconds delay_of_newest{0};
  std::chrono::nanoseconds stale_after{0};  ///< a longer silence is an outage

  /// The longest delay that the loop accepts by default: 50 ms for a device faster than 100 Hz,
  /// else three of its periods.
  [[nodiscard]] static constexpr std::chrono::nanoseconds delay_ceiling(
      std::chrono::nanoseconds period) noexcept {
    constexpr std::chrono::milliseconds kSlowPeriod{10};
    constexpr std::chrono::milliseconds kUsual{50};
    return period < kSlowPeriod ? kUsual : 3 * period;
  }
};

/// What was wrong with the readings of one output.
struct OutputFaults {
  std::string lack = {};  ///< why its device had no value for it, or some taxels; empty: it had
  std::uint64_t saturated = 0;            ///< readings at the end of the sensor's range
  std::uint64_t outside_calibration = 0;  ///< readings outside the range of their calibration
};

/// What a probe reports about itself.
struct ProbeStatus {
  std::optional<DeviceCounts> device = {};  ///< the counters so far; empty for a recording
  bool timed = false;                       ///< `timing` will be known after one second of samples
  std::optional<SampleTiming> timing = {};  ///< of the samples, once measured
  bool connected = true;                    ///< all its devices are plugged in
  /// Of the readings of a device for its first probe; null for others.
  const ProbeCalibration* calibration = nullptr;
  std::vector<OutputFaults> faults = {};  ///< of each output; empty: none are known
};

/// Receives the bytes that pass a port of a probe.
class PortListener {
 public:
  PortListener() = default;
  PortListener(const PortListener&) = delete;
  PortListener& operator=(const PortListener&) = delete;
  virtual ~PortListener() = default;

  /// Must not block. Thread: the port's reader or the thread that adds the listener; never both at
  /// once.
  virtual void take(const RawFrame& frame) noexcept = 0;
  /// At least this number of frames passed before the listener was added. Thread: as for take().
  virtual void missed(std::uint64_t frames) noexcept = 0;
};

/// A source of calibrated readings, opened by open_probe(): a device, which may feed several
/// probes, or a recording. Used by one thread except where noted.
class Probe {
 public:
  Probe() = default;
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  virtual ~Probe() = default;

  /// The probes that it feeds, at least one; their columns are those of its readings. Thread: any.
  [[nodiscard]] virtual std::span<const ProbeInfo> outputs() const noexcept = 0;
  /// Of its first output. Thread: any.
  [[nodiscard]] const ProbeInfo& info() const noexcept { return outputs().front(); }
  /// An empty list for its readings. Thread: any.
  [[nodiscard]] Readings readings(std::size_t most = 1024) const {
    return Readings(columns_of(outputs()), most);
  }

  /// Replaces `readings`, made by readings(), by the next ones, as many as fit at most; waits at
  /// most `patience` for the first one. None is a timeout, not an error. \return their number
  /// Real-time: no. Thread: probe.
  [[nodiscard]] virtual Expected<std::size_t, ProbeError> read(
      Readings& readings, std::chrono::milliseconds patience) = 0;
  /// The same for the samples of its first output.
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience);

  /// A sentence on the last error; empty at the end of the stream. Thread: probe.
  [[nodiscard]] virtual std::string error_message() const { return {}; }

  /// Thread: any.
  [[nodiscard]] virtual ProbeStatus status() const { return {}; }
  [[nodiscard]] std::optional<DeviceCounts> device_counts() const { return status().device; }
  [[nodiscard]] std::optional<SampleTiming> timing() const { return status().timing; }
  /// Messages since the last call: unplugged, reconnected, overloaded. Thread: any.
  [[nodiscard]] virtual std::vector<std::string> take_notices() { return {}; }

  /// Requests a tare of an output: the present force becomes zero, or the present depth if it has
  /// no force. A notice reports the result. False if the probe has no tare. Thread: any.
  [[nodiscard]] virtual bool request_tare(std::size_t /*output*/) noexcept { return false; }

  /// The number of its ports: one per device; 0 for a recording. Thread: any.
  [[nodiscard]] virtual std::size_t ports() const noexcept { return 0; }
  /// Sends all bytes of a port to a listener, from the opening of the port on, until it is removed.
  /// \param port  below ports(). Thread: any.
  virtual void add_listener(std::size_t /*port*/, PortListener& /*listener*/) {}
  virtual void remove_listener(std::size_t /*port*/, PortListener& /*listener*/) {}
};

}  // namespace merkel
