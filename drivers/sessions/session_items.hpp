#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sessions/session_chunk.hpp"

namespace merkel {

/// The positions of a stream's channels in a file. Channels are matched by label, so their order
/// and additional channels do not matter.
struct StreamLayout {
  static constexpr std::uint8_t kMissing = 0xFF;

  const SessionStream* stream = nullptr;
  std::size_t channels = 0;  ///< in the file
  /// The position in the file of each channel of `stream`.
  std::array<std::uint8_t, kMostSessionChannels> places{};
  /// Of samples: the places of the columns of ProbeSample::extra.
  std::vector<std::uint8_t> extra = {};
};

/// The values of one item, in the order of its stream's table of channels.
template <class Value>
using ItemValues = std::array<Value, kMostSessionChannels>;

// Writer and reader of an item: to_item() inverts values_of(). to_item() checks every value,
// because a file may hold any bytes; it returns false for an invalid one.

void values_of(const SpikeEvent& spike, ItemValues<std::int64_t>& values);
void values_of(const TickRecord& tick, ItemValues<double>& values);
void values_of(const DeliveredSample& item, ItemValues<double>& values);
void values_of(const LoopEvent& event, ItemValues<std::int64_t>& values);
void values_of(const RunStatus& status, ItemValues<std::int64_t>& values);
void values_of(const PortFrame& item, ItemValues<std::int64_t>& values);
void values_of(const StimulationCommand& command, ItemValues<double>& values);

[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, SpikeEvent& spike);
[[nodiscard]] bool to_item(const ItemValues<double>& values, TickRecord& tick);
[[nodiscard]] bool to_item(const ItemValues<double>& values, DeliveredSample& item);
[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, LoopEvent& event);
[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, RunStatus& status);
[[nodiscard]] bool to_item(const ItemValues<std::int64_t>& values, PortFrame& item);
[[nodiscard]] bool to_item(const ItemValues<double>& values, StimulationCommand& command);

/// Decodes the samples of one XDF chunk, without the stream number, into `chunk`. False if the
/// bytes are not samples of the stream or a value is invalid.
[[nodiscard]] bool decode_items(const StreamLayout& layout, std::string_view content,
                                SessionChunk& chunk);

/// The same for marks, which are strings.
[[nodiscard]] bool decode_marks(std::string_view content, SessionChunk& chunk);

}  // namespace merkel
