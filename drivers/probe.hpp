#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "core/probe_sample.hpp"

namespace merkel {

/// Why a probe has no more samples to give.
enum class ProbeError {
  kEndOfStream,  ///< a recording or a simulated press is over: nothing is wrong
  kBadData,      ///< a recording cannot be read on; trouble() says where and why
  kDisconnected  ///< a device is gone for good; trouble() says why
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
  [[nodiscard]] virtual std::string trouble() const { return {}; }
};

}  // namespace merkel
