#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/records/probe_sample.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The device's side of a protocol: its output while a trace is pressed against it. Has no port;
/// all times are those of the device's clock.
class SimulatedDevice {
 public:
  SimulatedDevice() = default;
  SimulatedDevice(const SimulatedDevice&) = delete;
  SimulatedDevice& operator=(const SimulatedDevice&) = delete;
  virtual ~SimulatedDevice() = default;

  /// Switches the device on or restarts it. \param out  its output, here and below
  virtual void boot(std::chrono::nanoseconds /*now*/, Bytes& /*out*/) {}
  /// Takes bytes from the host, in any portions.
  virtual void take(std::span<const std::uint8_t> /*bytes*/, std::chrono::nanoseconds /*now*/,
                    Bytes& /*out*/) {}
  /// Takes a measurement. Streaming devices send it at once, others on request.
  /// \param others  values of the columns of set_columns(), then of the taxels of set_taxels(), kPa
  virtual void measure(const ProbeSample& sample, std::span<const double> others,
                       std::chrono::nanoseconds now, Bytes& out) = 0;
  /// True if the press may start: the host listens, so that no sample is lost.
  [[nodiscard]] virtual bool started() const noexcept { return true; }
  /// The measuring period, if the host or the protocol sets it; default: the trace's.
  [[nodiscard]] virtual std::optional<std::chrono::nanoseconds> period() const noexcept {
    return std::nullopt;
  }
  /// Names the further columns of the played trace. False if the protocol cannot send them.
  [[nodiscard]] virtual bool set_columns(const std::vector<std::string>& names) {
    return names.empty();
  }
  /// Names the taxels of a tactile array. \param largest_kPa  pressure of the trace
  /// False if the protocol cannot send them.
  [[nodiscard]] virtual bool set_taxels(const std::vector<std::string>& names,
                                        double /*largest_kPa*/) {
    return names.empty();
  }
  /// Makes irregular pulses on a sync line. False if the protocol cannot report them.
  [[nodiscard]] virtual bool set_pulses(std::uint32_t /*seed*/) { return false; }
  /// Sets the rate of the played trace, for a device that reports a rate.
  virtual void set_rate(double /*rate_Hz*/) {}
  /// URI options that the protocol needs to read it.
  [[nodiscard]] virtual std::string uri_options() const { return {}; }

 protected:
  static void append(std::string_view text, Bytes& out) {
    out.insert(out.end(), text.begin(), text.end());
  }
};

}  // namespace merkel
