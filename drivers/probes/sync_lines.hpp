#pragma once

#include <chrono>
#include <span>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "core/records/sync_edge.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// Finds the edges of sync lines in channels of a device. A line is high from its level on, until
/// it falls below four fifths of it. The time of an edge is where the straight line between two
/// readings crosses: of a digital line, half-way between them. Thread: probe.
class SyncLines {
 public:
  static constexpr double kDigitalLevel = 0.5;

  SyncLines() = default;
  /// \param wanted    the option `sync`: channels with their levels, "trigger_mV:1500,other"
  /// \param channels  of the device; without an option, those that are sync lines by their name
  /// \return a sentence that names the wrong part
  [[nodiscard]] static Expected<SyncLines, std::string> choose(
      std::string_view wanted, std::span<const ChannelName> channels);

  /// Appends the edges since the last reading. None where readings are missing between them.
  void take(const DeviceReading& reading, std::chrono::nanoseconds time,
            std::vector<SyncEdge>& edges);

 private:
  struct Line {
    DeviceChannel channel;
    double level = kDigitalLevel;
    bool known = false;  ///< `value` is that of the last reading
    bool high = false;
    double value = 0.0;
  };
  std::vector<Line> lines_;
  std::chrono::nanoseconds time_{0};  ///< of the last reading
};

}  // namespace merkel
