#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/protocols/device_reading.hpp"
#include "drivers/protocols/device_units.hpp"

namespace merkel {

using Bytes = std::vector<std::uint8_t>;

/// Counters of a parser. Every received byte is in a good frame, a damaged one, or unread.
struct ProtocolCounts {
  std::uint64_t bytes = 0;          ///< received
  std::uint64_t frames = 0;         ///< complete and correct, of any kind
  std::uint64_t readings = 0;       ///< passed on
  std::uint64_t lost = 0;           ///< missing frames by sequence numbers; unanswered requests
  std::uint64_t damaged = 0;        ///< frames or lines that are invalid or fail their check
  std::uint64_t refused = 0;        ///< readings with a non-finite or impossible value
  std::uint64_t without_value = 0;  ///< of these, readings in which the device says it has none
  std::uint64_t duplicates = 0;     ///< repeated frames
  std::uint64_t reordered = 0;      ///< frames older than the newest one: dropped
  std::uint64_t reboots = 0;        ///< restarts of the device while it was open

  /// Frames that a working device does not send.
  [[nodiscard]] std::uint64_t bad() const noexcept {
    return damaged + refused - without_value + reordered;
  }
};

/// A request to the device's clock and its answer (SYNC of HBF1).
struct ClockExchange {
  std::chrono::nanoseconds sent{0};      ///< host
  std::chrono::nanoseconds received{0};  ///< host
  std::chrono::nanoseconds device_received{0};
  std::chrono::nanoseconds device_sent{0};
};

/// An edge of a sync line that a device reports with the time of its own clock.
struct DeviceEdge {
  std::uint16_t line = 1;  ///< from 1
  bool high = false;       ///< from here on
  std::chrono::nanoseconds device_time{0};
  std::chrono::nanoseconds arrival{0};
};

/// The output of a parser to its probe. The probe empties the lists.
struct DeviceStream {
  std::vector<DeviceReading> readings;
  std::vector<DeviceEdge> edges;
  std::vector<ClockExchange> exchanges;
  std::vector<std::string> notices;  ///< messages for the user
  bool columns_changed = false;      ///< Protocol::channel_names() has changed
  Bytes outgoing;                    ///< to be sent to the device
  bool from_start = false;           ///< the first byte is the device's first: no line is cut
  ProtocolCounts counts;
  std::string answer;    ///< the newest line, or else the newest bytes
  std::string rejected;  ///< the newest answer that was not as expected, to be quoted; empty: none

  /// Passes a reading on, unless it has a value beyond SampleLimits.
  void accept(const DeviceReading& reading) {
    if (reading.rebooted) ++counts.reboots;
    counts.lost += reading.lost;
    if (!plausible(reading)) {
      ++counts.refused;
      return;
    }
    ++counts.readings;
    readings.push_back(reading);
  }
  void send(std::string_view text) { outgoing.insert(outgoing.end(), text.begin(), text.end()); }
  void notice(std::string_view sentence) {
    if (notices.size() < kMaxNotices) {
      notices.emplace_back(sentence);
    } else {
      ++dropped_notices_;
    }
  }
  /// The number of notices that did not fit since the last call.
  std::uint64_t take_dropped_notices() { return std::exchange(dropped_notices_, 0); }

 private:
  static constexpr std::size_t kMaxNotices = 16;
  std::uint64_t dropped_notices_ = 0;
};

/// The period of a nominal rate; empty for 0, an unknown rate.
[[nodiscard]] inline std::optional<std::chrono::nanoseconds> period_of(double rate_Hz) {
  if (rate_Hz <= 0.0) return std::nullopt;
  return units::nanoseconds_from_s(1.0 / rate_Hz);
}

/// A channel of a device, as a scene names it.
struct ChannelName {
  std::string name;                               ///< with its unit: "force_N", "thumb_N"
  DeviceChannel channel = DeviceChannel::kForce;  ///< of a DeviceReading
  std::size_t column = 0;                         ///< its place in the device's data, from 1
  Quantity quantity = Quantity::kForce;
  double factor = 1.0;  ///< of the unit in its name, to that of a reading
};

/// The names of known quantities. \param channels  bits of DeviceChannel
[[nodiscard]] inline std::vector<ChannelName> names_of_channels(std::uint32_t channels) {
  std::vector<ChannelName> names;
  for (std::size_t i = 0; i < kDeviceChannels; ++i) {
    const auto channel = static_cast<DeviceChannel>(i);
    if ((channels & bit_of(channel)) == 0U) continue;
    const bool force = channel <= DeviceChannel::kForceZ;
    names.push_back({.name = std::string(kDeviceChannelNames[i]) + (force ? "_N" : "_mm"),
                     .channel = channel,
                     .column = names.size() + 1,
                     .quantity = force ? Quantity::kForce : Quantity::kLength});
  }
  return names;
}

/// The protocol of a device: bytes in, readings out, requests back. Has no port and no clock: the
/// owner moves the bytes and passes the time. Times are host-monotonic.
/// Real-time: no. Thread: probe.
class Protocol {
 public:
  Protocol() = default;
  Protocol(const Protocol&) = delete;
  Protocol& operator=(const Protocol&) = delete;
  virtual ~Protocol() = default;

  /// The port was opened or reopened: drops partial frames and requests the device's facts.
  virtual void begin(std::chrono::nanoseconds now, DeviceStream& stream) = 0;
  /// Starts the readings; also applies after later calls of begin().
  virtual void start(std::chrono::nanoseconds /*now*/, DeviceStream& /*stream*/) {}
  /// Called before the port is closed: stops the device's stream.
  virtual void end(DeviceStream& /*stream*/) {}

  /// Takes received bytes, in any portions. \param arrival  the time of reading
  virtual void take(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds arrival,
                    DeviceStream& stream) = 0;
  /// Sends due requests. Returns the time of the next call; empty if none is needed.
  virtual std::optional<std::chrono::nanoseconds> poll(std::chrono::nanoseconds /*now*/,
                                                       DeviceStream& /*stream*/) {
    return std::nullopt;
  }

  /// The known quantities among its readings, as bits of DeviceChannel; 0 until known.
  [[nodiscard]] virtual std::uint32_t channels() const noexcept = 0;
  /// All channels of its readings, those with names of their own included.
  [[nodiscard]] virtual std::vector<ChannelName> channel_names() const {
    return names_of_channels(channels());
  }
  /// True if start() may be called; then there is a channel.
  [[nodiscard]] virtual bool ready() const noexcept { return channels() != 0U; }
  /// True if the device reports its channels. For other devices, the first reading is the first
  /// sign that the protocol is right.
  [[nodiscard]] virtual bool describes_itself() const noexcept { return false; }
  /// What the device should send, to be named beside what it sent instead ("records of 36 bytes").
  /// \param answer  the line or bytes that it sent
  [[nodiscard]] virtual std::string expected(std::string_view answer) const = 0;
  /// A permanent error, such as an unknown unit; empty if none.
  [[nodiscard]] virtual const std::string& error_message() const noexcept { return kNone; }
  /// Nominal period of the readings, if known.
  [[nodiscard]] virtual std::optional<std::chrono::nanoseconds> period() const noexcept {
    return std::nullopt;
  }
  /// The period after which the device's clock wraps to 0, if it does.
  [[nodiscard]] virtual std::optional<std::chrono::nanoseconds> clock_wrap() const noexcept {
    return std::nullopt;
  }
  /// The device's serial number, if the protocol transmits it.
  [[nodiscard]] virtual std::string serial_number() const { return {}; }

 private:
  inline static const std::string kNone;
};

}  // namespace merkel
