#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/protocols/device_reading.hpp"

namespace merkel {

using Bytes = std::vector<std::uint8_t>;

/// What a parser counted. Every byte that came is in a good frame, a damaged one, or unread.
struct ProtocolCounts {
  std::uint64_t bytes = 0;     ///< received
  std::uint64_t frames = 0;    ///< whole and correct, of any kind
  std::uint64_t readings = 0;  ///< handed on
  std::uint64_t lost = 0;      ///< frames missing by the sequence numbers; requests never answered
  std::uint64_t damaged = 0;   ///< frames or lines that make no sense, or fail their check
  std::uint64_t refused = 0;   ///< readings with a non-finite or impossible value
  std::uint64_t duplicates = 0;  ///< frames that came twice
  std::uint64_t reboots = 0;     ///< times the device started anew while it was open
};

/// One question to the device's clock and its answer (SYNC of HBF1).
struct ClockExchange {
  std::chrono::nanoseconds sent{0};      ///< host
  std::chrono::nanoseconds received{0};  ///< host
  std::chrono::nanoseconds device_received{0};
  std::chrono::nanoseconds device_sent{0};
};

/// What goes from a parser to the probe that owns it. The probe empties the lists.
struct DeviceStream {
  std::vector<DeviceReading> readings;
  std::vector<ClockExchange> exchanges;
  std::vector<std::string> notices;  ///< sentences for the user
  Bytes outgoing;                    ///< to be sent to the device
  ProtocolCounts counts;

  /// Hands a reading on, unless it holds a value that no probe can measure.
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
  void notice(std::string sentence) {
    if (notices.size() < kMostNotices) {
      notices.push_back(std::move(sentence));
    } else {
      ++notices_left_out_;
    }
  }
  /// Of sentences that found no room since the last call.
  std::uint64_t take_notices_left_out() { return std::exchange(notices_left_out_, 0); }

 private:
  static constexpr std::size_t kMostNotices = 16;
  std::uint64_t notices_left_out_ = 0;
};

/// The language of a device: bytes in, readings out, requests back. Knows no port and no clock;
/// whoever owns it moves the bytes and says what time it is. Times are host-monotonic.
/// Real-time: no. Thread: probe.
class Protocol {
 public:
  Protocol() = default;
  Protocol(const Protocol&) = delete;
  Protocol& operator=(const Protocol&) = delete;
  virtual ~Protocol() = default;

  /// The port was opened, or opened again: forgets unfinished frames and asks what must be known.
  virtual void begin(std::chrono::nanoseconds now, DeviceStream& stream) = 0;
  /// From here on readings are wanted, across later calls of begin() too.
  virtual void start(std::chrono::nanoseconds /*now*/, DeviceStream& /*stream*/) {}
  /// The port is going to be closed: leaves the device quiet.
  virtual void end(DeviceStream& /*stream*/) {}

  /// Bytes as they came, in any portions. \param arrival  when they were read
  virtual void take(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds arrival,
                    DeviceStream& stream) = 0;
  /// Asks for what is due. Returns when it wants to be called again; never, if nothing.
  virtual std::optional<std::chrono::nanoseconds> poll(std::chrono::nanoseconds /*now*/,
                                                       DeviceStream& /*stream*/) {
    return std::nullopt;
  }

  /// The channels of its readings; 0 until the device has said so.
  [[nodiscard]] virtual std::uint32_t channels() const noexcept = 0;
  /// Whether all is known that start() needs; then channels() is not 0.
  [[nodiscard]] virtual bool ready() const noexcept { return channels() != 0U; }
  /// Whether the device tells its channels by itself; of the others, the first reading is the
  /// first sign that it is what it is taken for.
  [[nodiscard]] virtual bool describes_itself() const noexcept { return false; }
  /// What is wrong for good, such as a unit that is not known. Empty if nothing.
  [[nodiscard]] virtual const std::string& error_message() const noexcept { return kNone; }
  /// Nominal period of the readings, where known.
  [[nodiscard]] virtual std::optional<std::chrono::nanoseconds> period() const noexcept {
    return std::nullopt;
  }
  /// After how long the device's clock starts again from 0, where it does.
  [[nodiscard]] virtual std::optional<std::chrono::nanoseconds> clock_wrap() const noexcept {
    return std::nullopt;
  }
  /// The device's own serial number, where the protocol tells it.
  [[nodiscard]] virtual std::string serial_number() const { return {}; }

 private:
  inline static const std::string kNone;
};

}  // namespace merkel
