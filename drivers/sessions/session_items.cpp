#include "drivers/sessions/session_items.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <tuple>
#include <type_traits>

#include "drivers/sessions/byte_span.hpp"
#include "drivers/sessions/session_records.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using std::chrono::nanoseconds;

constexpr double kLargestMarkTime_s = 4e9;

/// Calls take(values in the order of the file) for each sample of a chunk, which has a stamp and
/// 8-byte values. False if the bytes are not such samples, or take() returns false.
template <class Value, class Take>
bool for_each_sample_row(ByteSpan& bytes, std::uint64_t count, std::size_t channels,
                         const Take& take) {
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint8_t stamp_bytes = 0;
    double stamp = 0.0;
    if (!bytes.take(stamp_bytes) || (stamp_bytes != 0 && stamp_bytes != 8) ||
        (stamp_bytes == 8 && !bytes.take(stamp))) {
      return false;
    }
    ItemValues<Value> in_file{};
    for (std::size_t channel = 0; channel < channels; ++channel) {
      if (!bytes.take(in_file[channel])) return false;
    }
    if (!take(in_file)) return false;
  }
  return bytes.left() == 0;
}

/// Each sample has its values and at least one byte more.
bool holds_rows(const ByteSpan& bytes, std::uint64_t count, const StreamLayout& layout) {
  return count <= bytes.left() / (layout.channels * sizeof(double) + 1);
}

/// Takes what the file lacks from the expected item. False if there is none.
bool fill_in(const StreamLayout& layout, const FollowingItem& next, ItemValues<double>& values) {
  const auto channels = layout.stream->channels;
  for (std::size_t i = 0; i < channels.size() && layout.stream->of_probe(); ++i) {
    if (layout.has(i)) continue;
    if (next.known) {
      values[i] = next.values[i];
    } else if (!channels[i].later) {
      return false;
    }
  }
  return true;
}

template <class Value, class Item>
bool take_items(ByteSpan& bytes, std::uint64_t count, const StreamLayout& layout,
                FollowingItem& next, std::vector<Item>& items) {
  if (!holds_rows(bytes, count, layout)) return false;
  items.reserve(items.size() + count);
  const auto take = [&](const ItemValues<Value>& in_file) {
    ItemValues<Value> values{};
    for (std::size_t channel = 0; channel < layout.stream->channels.size(); ++channel) {
      const bool later = layout.stream->channels[channel].later;
      values[channel] = layout.has(channel) ? in_file[layout.places[channel]]
                                            : static_cast<Value>(later ? 0 : kMissingValue);
    }
    if constexpr (std::is_same_v<Value, double>) {
      if (!fill_in(layout, next, values)) return false;
      next.values = values;
      follow(*layout.stream, next.tick, next.values);
    }
    if (!to_item(values, items.emplace_back())) return false;
    if constexpr (std::is_same_v<Item, DeliveredSample>) {
      auto& further = items.back().further;
      further.assign(layout.extra_columns, std::numeric_limits<double>::quiet_NaN());
      for (const auto& [place, column] : layout.extra) further[column] = in_file[place];
    }
    return true;
  };
  return for_each_sample_row<Value>(bytes, count, layout.channels, take);
}

}  // namespace

bool decode_items(const StreamLayout& layout, std::string_view content, FollowingItem& next,
                  SessionChunk& chunk) {
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count)) return false;
  bool good = false;
  for_each_kind(chunk, [&]<class Record>(std::vector<Record>& list) {
    if constexpr (kStored<Record>) {
      using Stored = SessionStreamOf<Record>;
      if (Stored::kId != layout.stream->id) return;
      good = take_items<typename Stored::Value>(bytes, count, layout, next, list);
    }
  });
  chunk.stream = layout.stream->id;
  return good;
}

bool decode_states(const StreamLayout& layout, std::string_view content,
                   std::span<FollowingItem> next) {
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count) || !holds_rows(bytes, count, layout)) return false;
  const auto channels = layout.stream->channels;
  return for_each_sample_row<double>(bytes, count, layout.channels,
                                     [&](const ItemValues<double>& in_file) {
                                       ItemValues<double> values{};
                                       std::size_t probe = next.size();
                                       for (std::size_t i = 0; i < channels.size(); ++i) {
                                         if (!layout.has(i)) continue;
                                         values[i] = in_file[layout.places[i]];
                                         if (channels[i].label != "probe" || !(values[i] >= 0.0))
                                           continue;
                                         if (values[i] < static_cast<double>(next.size())) {
                                           probe = static_cast<std::size_t>(values[i]);
                                         }
                                       }
                                       if (probe == next.size()) return false;
                                       next[probe].known = true;
                                       next[probe].values = values;
                                       return true;
                                     });
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

bool decode_clock_readings(std::string_view content, std::vector<ClockReading>& readings) {
  constexpr std::int64_t kLargestTime_ns = std::int64_t{1} << 62U;
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count) || count > bytes.left()) return false;
  return for_each_sample_row<std::int64_t>(
      bytes, count, 2, [&](const ItemValues<std::int64_t>& values) {
        for (const std::int64_t time_ns : {values[0], values[1]}) {
          if (time_ns < -kLargestTime_ns || time_ns > kLargestTime_ns) return false;
        }
        readings.push_back({.from = nanoseconds{values[0]}, .to = nanoseconds{values[1]}});
        return true;
      });
}

}  // namespace merkel
