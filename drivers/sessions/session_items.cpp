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
#include <optional>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "drivers/sessions/session_records.hpp"
#include "drivers/sessions/xdf_samples.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using std::chrono::nanoseconds;

constexpr double kLargestMarkTime_s = 4e9;

/// Calls take(values in the order of the file) for each sample of a chunk, of 8-byte values.
/// False if the bytes are not such samples, or take() returns false.
template <class Value, class Take>
bool for_each_row(std::string_view content, std::size_t channels, const Take& take) {
  return for_each_xdf_sample(content, {.channels = channels},
                             [&](std::optional<double> /*stamp_s*/, XdfRow row) {
                               ItemValues<Value> in_file{};
                               std::memcpy(in_file.data(), row[0].data(), row[0].size());
                               return take(in_file);
                             });
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
bool take_items(std::string_view content, const StreamLayout& layout, FollowingItem& next,
                std::vector<Item>& items) {
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
  return for_each_row<Value>(content, layout.channels, take);
}

}  // namespace

bool decode_items(const StreamLayout& layout, std::string_view content, FollowingItem& next,
                  SessionChunk& chunk) {
  bool good = false;
  for_each_kind(chunk, [&]<class Record>(std::vector<Record>& list) {
    if constexpr (kStored<Record>) {
      using Stored = SessionStreamOf<Record>;
      if (Stored::kId != layout.stream->id) return;
      good = take_items<typename Stored::Value>(content, layout, next, list);
    }
  });
  chunk.stream = layout.stream->id;
  return good;
}

bool decode_states(const StreamLayout& layout, std::string_view content,
                   std::span<FollowingItem> next) {
  const auto channels = layout.stream->channels;
  const auto take = [&](const ItemValues<double>& in_file) {
    ItemValues<double> values{};
    std::size_t probe = next.size();
    for (std::size_t i = 0; i < channels.size(); ++i) {
      if (!layout.has(i)) continue;
      values[i] = in_file[layout.places[i]];
      if (channels[i].label != "probe" || !(values[i] >= 0.0)) continue;
      if (values[i] < static_cast<double>(next.size())) probe = static_cast<std::size_t>(values[i]);
    }
    if (probe == next.size()) return false;
    next[probe].known = true;
    next[probe].values = values;
    return true;
  };
  return for_each_row<double>(content, layout.channels, take);
}

bool decode_marks(std::string_view content, SessionChunk& chunk) {
  const auto take = [&](std::optional<double> stamp_s, XdfRow row) {
    if (!stamp_s || !(std::fabs(*stamp_s) <= kLargestMarkTime_s)) return false;
    const nanoseconds time{static_cast<std::int64_t>(std::llround(*stamp_s * 1e9))};
    chunk.marks.push_back({.time = time, .label = std::string(row[0])});
    return true;
  };
  return for_each_xdf_sample(content, {.channels = 1, .value_bytes = 0}, take);
}

bool decode_clock_readings(std::string_view content, std::vector<ClockReading>& readings) {
  constexpr std::int64_t kLargestTime_ns = std::int64_t{1} << 62U;
  return for_each_row<std::int64_t>(content, 2, [&](const ItemValues<std::int64_t>& values) {
    for (const std::int64_t time_ns : {values[0], values[1]}) {
      if (time_ns < -kLargestTime_ns || time_ns > kLargestTime_ns) return false;
    }
    readings.push_back({.from = nanoseconds{values[0]}, .to = nanoseconds{values[1]}});
    return true;
  });
}

}  // namespace merkel
