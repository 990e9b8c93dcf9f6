#include "drivers/probes/sync_lines.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/parameters/nearest_name.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/printable_text.hpp"

namespace merkel {
namespace {

constexpr double kHysteresis = 0.2;  ///< of the level

}  // namespace

Expected<SyncLines, std::string> SyncLines::choose(std::string_view wanted,
                                                   std::span<const ChannelName> channels) {
  SyncLines lines;
  for (const ChannelName& each : channels) {
    if (wanted.empty() && each.quantity == Quantity::kSync)
      lines.lines_.push_back({.channel = each.channel});
  }
  while (!wanted.empty()) {
    const std::string_view part = take_field(wanted);
    const std::string_view name = part.substr(0, part.find(':'));
    const auto found = std::find_if(channels.begin(), channels.end(),
                                    [&](const ChannelName& each) { return each.name == name; });
    const auto level =
        name.size() == part.size() ? kDigitalLevel : parse_number(part.substr(name.size() + 1));
    if (found == channels.end()) {
      return Unexpected<std::string>("sync=" + std::string(part) +
                                     " names no channel of the device, which has " +
                                     printable_text(listed(channels, &ChannelName::name)));
    }
    if (!level || !std::isfinite(*level) || *level == 0.0) {
      return Unexpected<std::string>("sync=" + std::string(part) +
                                     ": after the colon comes the level from which the line is "
                                     "high, for example sync=" +
                                     std::string(name) + ":1.5");
    }
    lines.lines_.push_back({.channel = found->channel, .level = *level * found->factor});
  }
  return lines;
}

void SyncLines::take(const DeviceReading& reading, std::chrono::nanoseconds time,
                     std::vector<SyncEdge>& edges) {
  const bool follows = reading.lost == 0 && !reading.rebooted;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    Line& line = lines_[i];
    const double value = reading[line.channel];
    const double level = line.level - (line.high ? kHysteresis * std::fabs(line.level) : 0.0);
    const bool valid = std::isfinite(value);
    const bool high = valid && value >= level;
    if (valid && line.known && follows && high != line.high && time > time_) {
      const double part = std::clamp((level - line.value) / (value - line.value), 0.0, 1.0);
      edges.push_back({.time = time_ + std::chrono::nanoseconds{std::llround(
                                           part * static_cast<double>((time - time_).count()))},
                       .line = static_cast<std::uint16_t>(i + 1),
                       .level = static_cast<std::uint16_t>(high ? 1 : 0)});
    }
    line = {.channel = line.channel,
            .level = line.level,
            .known = valid,
            .high = high,
            .value = valid ? value : 0.0};
  }
  time_ = time;
}

}  // namespace merkel
