#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/records/probe_sample.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The other end of a protocol: what a device says while a trace is pressed against it. Knows no
/// port and no clock; times are by its own clock.
class SimulatedDevice {
 public:
  SimulatedDevice() = default;
  SimulatedDevice(const SimulatedDevice&) = delete;
  SimulatedDevice& operator=(const SimulatedDevice&) = delete;
  virtual ~SimulatedDevice() = default;

  /// It is switched on, or starts anew. \param out  what it says, here and below
  virtual void boot(std::chrono::nanoseconds /*now*/, Bytes& /*out*/) {}
  /// Bytes from the host, in any portions.
  virtual void take(std::span<const std::uint8_t> /*bytes*/, std::chrono::nanoseconds /*now*/,
                    Bytes& /*out*/) {}
  /// It measures: streaming devices say so at once, others when they are asked.
  virtual void measure(const ProbeSample& sample, std::chrono::nanoseconds now, Bytes& out) = 0;
  /// Whether the press may begin: nothing is lost on a host that has not started to listen.
  [[nodiscard]] virtual bool started() const noexcept { return true; }
  /// How often it measures, where the host or its kind sets that; else as often as the trace.
  [[nodiscard]] virtual std::optional<std::chrono::nanoseconds> period() const noexcept {
    return std::nullopt;
  }
  /// The rate of the trace that it plays, for a device that reports one.
  virtual void set_rate(double /*rate_Hz*/) {}
  /// Options without which the protocol cannot read it, as in a URI.
  [[nodiscard]] virtual std::string uri_options() const { return {}; }
};

}  // namespace merkel
