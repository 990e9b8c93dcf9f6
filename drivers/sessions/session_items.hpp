#pragma once

#include <chrono>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/clock/clock_map.hpp"
#include "drivers/sessions/session_chunk.hpp"
#include "drivers/sessions/session_layout.hpp"

namespace merkel {

/// What the next item of a probe's stream has in the channels that the stream lacks.
struct FollowingItem {
  bool known = false;
  ItemValues<double> values{};
  std::chrono::nanoseconds tick{0};  ///< of the run
};

/// Decodes the samples of one XDF chunk, without the stream number, into `chunk`. False if the
/// bytes are not samples of the stream or a value is invalid. \param next  read and written
[[nodiscard]] bool decode_items(const StreamLayout& layout, std::string_view content,
                                FollowingItem& next, SessionChunk& chunk);

/// Decodes states. \param next  of the stream's probes, written
[[nodiscard]] bool decode_states(const StreamLayout& layout, std::string_view content,
                                 std::span<FollowingItem> next);

/// The same for marks, which are strings.
[[nodiscard]] bool decode_marks(std::string_view content, SessionChunk& chunk);

/// Appends readings of the clocks.
[[nodiscard]] bool decode_clock_readings(std::string_view content,
                                         std::vector<ClockReading>& readings);

}  // namespace merkel
