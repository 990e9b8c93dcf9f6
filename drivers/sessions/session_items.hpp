#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/sessions/session_chunk.hpp"

namespace merkel {

/// Where the channels of a stream stand in a file: channels are matched by label, so that neither
/// their order nor further channels matter.
struct StreamLayout {
  static constexpr std::uint8_t kMissing = 0xFF;

  const SessionStream* stream = nullptr;
  std::size_t channels = 0;  ///< in the file
  /// Of each channel of `stream`: its place in the file.
  std::array<std::uint8_t, kMostSessionChannels> places{};
};

/// The value of one item at each channel of its stream, in the order of the table of channels.
template <class Value>
using ItemValues = std::array<Value, kMostSessionChannels>;

// Writer and reader of an item side by side: what values_of() lists, to_item() takes back. A
// to_item() checks everything, because a file may hold any bytes; false where a value cannot be.

void values_of(const SpikeEvent& spike, ItemValues<std::int64_t>& values);
void values_of(const TickRecord& tick, ItemValues<double>& values);
void values_of(const SessionChunk::Sample& item, ItemValues<double>& values);
void values_of(const LoopEvent& event, ItemValues<std::int64_t>& values);
void values_of(const RunStatus& status, ItemValues<std::int64_t>& values);
void values_of(const SessionChunk::Frame& item, ItemValues<std::int64_t>& values);
void values_of(const StimulationCommand& command, ItemValues<double>& values);

[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, SpikeEvent& spike);
[[nodiscard]] bool to_item(const ItemValues<double>& values, TickRecord& tick);
[[nodiscard]] bool to_item(const ItemValues<double>& values, SessionChunk::Sample& item);
[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, LoopEvent& event);
[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, RunStatus& status);
[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, SessionChunk::Frame& item);
[[nodiscard]] bool to_item(const ItemValues<double>& values, StimulationCommand& command);

/// Decodes the samples of one XDF chunk, stream number excluded, into `chunk`. False where the
/// bytes are no samples of that stream, or a value cannot be.
[[nodiscard]] bool decode_items(const StreamLayout& layout, std::string_view content,
                                SessionChunk& chunk);

/// The same for marks, whose samples are strings.
[[nodiscard]] bool decode_marks(std::string_view content, SessionChunk& chunk);

}  // namespace merkel
