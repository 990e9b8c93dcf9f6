#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/raw_frame.hpp"

namespace merkel {

struct ProbeCalibration;

/// Why a probe has no more samples to give.
enum class ProbeError {
  kEndOfStream,  ///< a recording or a simulated press is over: nothing is wrong
  kBadData,      ///< a recording cannot be read on; error_message() says where and why
  kDisconnected  ///< a device is gone for good; error_message() says why
};

/// What a probe is.
struct ProbeInfo {
  std::string uri;             ///< as the user gave it
  std::string name;            ///< for people
  std::string serial_number;   ///< of the device; empty for recordings
  std::uint32_t channels = 0;  ///< ProbeSample::Channel bits that every sample carries
  std::optional<std::chrono::nanoseconds> period;  ///< nominal sample period, where known
  /// True for a recording: its times are its own, and it waits while nobody takes its samples.
  /// False for a device: its times are host-monotonic, and samples that find no room are lost.
  bool replayed = false;
  std::string calibration_file = {};  ///< as the user gave it; empty for none
  std::string calibration = {};       ///< in force, as the text of such a file; of a device only
};

/// What the driver of a device counted, beyond what the loop sees.
struct DeviceCounts {
  std::string port;  ///< how the device was opened
  std::uint64_t readings = 0;
  std::uint64_t lost = 0;                ///< by its sequence numbers, or asked for in vain
  std::uint64_t damaged = 0;             ///< frames that failed their check
  std::uint64_t refused = 0;             ///< values that no probe can measure
  std::uint64_t duplicates = 0;          ///< frames that came twice, or that nobody had asked for
  std::uint64_t saturated = 0;           ///< readings at the end of the sensor's range
  std::uint64_t reboots = 0;             ///< times it started anew
  std::uint64_t outages = 0;             ///< times it was unplugged
  std::chrono::nanoseconds outage{0};    ///< how long all of them took
  std::uint64_t largest_batch = 0;       ///< most readings that came at once
  double rate_Hz = 0.0;                  ///< readings per second, achieved
  bool device_clock = false;             ///< times are those of the device's own clock, mapped
  double drift_ppm = 0.0;                ///< of that clock
  double jitter_us = 0.0;                ///< of the mapped times
  double latency_us = 0.0;               ///< mean of arrival after the mapped time
  std::optional<double> uncertainty_us;  ///< of the sample times, where it can be known
  std::uint64_t clock_outliers = 0;      ///< times of that clock that cannot be: arrivals were used
  std::uint64_t clock_anchors = 0;       ///< times it was mapped from scratch, having jumped
  double clock_rate = 1.0;               ///< its seconds per second of the host
  bool clock_mistrusted = false;         ///< its rate is not the host's: arrivals are used
};

/// How often a device's samples come and how late, as measured.
struct SampleTiming {
  std::chrono::nanoseconds period{0};
  std::chrono::nanoseconds jitter{0};  ///< 99.9 % of arrivals are later than due by no more
  /// So long after a time the samples on both its sides are there.
  std::chrono::nanoseconds delay{0};
  /// So long after a time the samples before it are there.
  std::chrono::nanoseconds delay_of_newest{0};
  std::chrono::nanoseconds stale_after{0};  ///< a longer silence is an outage
};

/// Gets the bytes that go over a port of a probe.
class PortListener {
 public:
  PortListener() = default;
  PortListener(const PortListener&) = delete;
  PortListener& operator=(const PortListener&) = delete;
  virtual ~PortListener() = default;

  /// Must not block. Thread: the one that reads the port, or the one that adds the listener; never
  /// both at once.
  virtual void take(const RawFrame& frame) noexcept = 0;
  /// At least so many frames went by before it was added. Thread: as take().
  virtual void missed(std::uint64_t frames) noexcept = 0;
};

/// A source of calibrated samples. Open by the factory of its kind; used by one thread.
class Probe {
 public:
  Probe() = default;
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  virtual ~Probe() = default;

  /// Thread: any.
  [[nodiscard]] virtual const ProbeInfo& info() const noexcept = 0;

  /// Reads up to samples.size() samples in strictly increasing time, waiting at most `patience`
  /// for the first. 0 samples is a timeout, not an error. Real-time: no. Thread: probe.
  [[nodiscard]] virtual Expected<std::size_t, ProbeError> read(
      std::span<ProbeSample> samples, std::chrono::milliseconds patience) = 0;

  /// A sentence about the last error other than the end of the stream. Thread: probe.
  [[nodiscard]] virtual std::string error_message() const { return {}; }

  /// What was counted so far; nothing for a recording. Thread: any.
  [[nodiscard]] virtual std::optional<DeviceCounts> device_counts() const { return std::nullopt; }
  /// Whether timing() will be known after a second of samples. Thread: any.
  [[nodiscard]] virtual bool is_timed() const noexcept { return false; }
  /// How its samples come, once enough of them have; nothing for a recording. Thread: any.
  [[nodiscard]] virtual std::optional<SampleTiming> timing() const { return std::nullopt; }
  /// What a device's readings are turned into samples by; null for all others. Thread: any.
  [[nodiscard]] virtual const ProbeCalibration* calibration() const noexcept { return nullptr; }
  /// Sentences about what happened since the last call: unplugged, back, overloaded. Thread: any.
  [[nodiscard]] virtual std::vector<std::string> take_notices() { return {}; }

  /// Asks for the present reading to be taken as zero: of force, or of depth where the probe has no
  /// force. A notice says what came of it. False where the probe cannot. Thread: any.
  [[nodiscard]] virtual bool request_tare() noexcept { return false; }
  /// Whether all its devices are plugged in. Thread: any.
  [[nodiscard]] virtual bool connected() const noexcept { return true; }

  /// How many ports it reads: one of each device; none of a recording. Thread: any.
  [[nodiscard]] virtual std::size_t ports() const noexcept { return 0; }
  /// Tells a listener what goes over a port, from its opening on, until it is removed.
  /// \param port  below ports(). Thread: any.
  virtual void add_listener(std::size_t /*port*/, PortListener& /*listener*/) {}
  virtual void remove_listener(std::size_t /*port*/, PortListener& /*listener*/) {}
};

}  // namespace merkel
