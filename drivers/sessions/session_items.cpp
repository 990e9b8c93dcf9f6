#include "drivers/sessions/session_items.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <tuple>
#include <type_traits>

#include "drivers/sessions/byte_span.hpp"
#include "drivers/sessions/session_records.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using std::chrono::nanoseconds;

constexpr double kLargestMarkTime_s = 4e9;

/// Decodes the samples of one chunk, each with a stamp and 8-byte values.
template <class Value, class Item>
bool take_items(ByteSpan& bytes, std::uint64_t count, const StreamLayout& layout,
                std::vector<Item>& items) {
  // Each sample has its values and at least one byte more.
  if (count > bytes.left() / (layout.channels * sizeof(Value) + 1)) return false;
  items.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint8_t stamp_bytes = 0;
    double stamp = 0.0;
    if (!bytes.take(stamp_bytes) || (stamp_bytes != 0 && stamp_bytes != 8) ||
        (stamp_bytes == 8 && !bytes.take(stamp))) {
      return false;
    }
    ItemValues<Value> in_file{};
    for (std::size_t channel = 0; channel < layout.channels; ++channel) {
      if (!bytes.take(in_file[channel])) return false;
    }
    ItemValues<Value> values{};
    for (std::size_t channel = 0; channel < layout.stream->channels.size(); ++channel) {
      const std::uint8_t place = layout.places[channel];
      values[channel] = place == StreamLayout::kMissing ? Value{kMissingValue} : in_file[place];
    }
    if (!to_item(values, items.emplace_back())) return false;
    if constexpr (std::is_same_v<Item, DeliveredSample>) {
      for (std::size_t k = 0; k < layout.extra.size(); ++k) {
        items.back().sample.extra[k] = in_file[layout.extra[k]];
      }
    }
  }
  return true;
}

}  // namespace

bool decode_items(const StreamLayout& layout, std::string_view content, SessionChunk& chunk) {
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count)) return false;
  bool good = false;
  for_each_kind(chunk, [&]<class Record>(std::vector<Record>& list) {
    if constexpr (kStored<Record>) {
      using Stored = SessionStreamOf<Record>;
      if (Stored::kId != layout.stream->id) return;
      good = take_items<typename Stored::Value>(bytes, count, layout, list);
    }
  });
  chunk.stream = layout.stream->id;
  return good && bytes.left() == 0;
}

bool decode_marks(std::string_view content, SessionChunk& chunk) {
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count) || count > bytes.left()) return false;
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint8_t stamp_width = 0;
    double stamp_s = 0.0;
    std::uint64_t length = 0;
    std::string_view label;
    if (!bytes.take(stamp_width) || stamp_width != sizeof stamp_s || !bytes.take(stamp_s) ||
        !(std::fabs(stamp_s) <= kLargestMarkTime_s) || !bytes.take_count(length) ||
        !bytes.take_text(length, label)) {
      return false;
    }
    const nanoseconds time{static_cast<std::int64_t>(std::llround(stamp_s * 1e9))};
    chunk.marks.push_back({.time = time, .label = std::string(label)});
  }
  return bytes.left() == 0;
}

}  // namespace merkel
