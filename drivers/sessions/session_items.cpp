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

#include "drivers/sample_limits.hpp"
#include "drivers/sessions/byte_span.hpp"
#include "drivers/sessions/session_columns.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

constexpr double kLargestMarkTime_s = 4e9;
using Doubles = ItemValues<double>;
using Integers = ItemValues<std::int64_t>;

// Values that the types of their members do not limit enough.

bool valid(const TickRecord& tick) {
  return plausible(tick.contact.depth_mm, SampleLimits::kDepth_mm) &&
         plausible(tick.contact.force_mN, SampleLimits::kForce_mN) &&
         plausible(tick.contact.x_mm, SampleLimits::kPosition_mm) &&
         plausible(tick.contact.y_mm, SampleLimits::kPosition_mm);
}

bool valid(const StimulationCommand& command) {
  constexpr double kLargestValue = 1e6;  // far above the limits of scenes
  return command.amplitude_uA >= 0.0 && command.amplitude_uA <= kLargestValue &&
         command.frequency_Hz >= 0.0 && command.frequency_Hz <= kLargestValue;
}

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

void values_of(const SpikeEvent& spike, Integers& values) {
  columns_to_values(kSpikeColumns, spike, values);
}

bool to_item(const Integers& values, SpikeEvent& spike) {
  return values_to_columns(kSpikeColumns, values, spike);
}

void values_of(const LoopEvent& event, Integers& values) {
  columns_to_values(kEventColumns, event, values);
}

bool to_item(const Integers& values, LoopEvent& event) {
  return values_to_columns(kEventColumns, values, event);
}

void values_of(const TickRecord& tick, Doubles& values) {
  columns_to_values(kTickColumns, tick, values);
}

bool to_item(const Doubles& values, TickRecord& tick) {
  return values_to_columns(kTickColumns, values, tick) && valid(tick);
}

void values_of(const DeliveredSample& item, Doubles& values) {
  columns_to_values(kProbeSampleColumns, item, values);
}

bool to_item(const Doubles& values, DeliveredSample& item) {
  return values_to_columns(kProbeSampleColumns, values, item) && plausible(item.sample);
}

void values_of(const StimulationCommand& command, Doubles& values) {
  columns_to_values(kCommandColumns, command, values);
}

bool to_item(const Doubles& values, StimulationCommand& command) {
  return values_to_columns(kCommandColumns, values, command) && valid(command);
}

void values_of(const PortFrame& item, Integers& values) {
  columns_to_values(kFrameColumns, item, values);
  std::memcpy(&values[std::tuple_size_v<decltype(kFrameColumns)>], item.frame.bytes.data(),
              item.frame.bytes.size());
}

bool to_item(const Integers& values, PortFrame& item) {
  std::memcpy(item.frame.bytes.data(), &values[std::tuple_size_v<decltype(kFrameColumns)>],
              item.frame.bytes.size());
  return values_to_columns(kFrameColumns, values, item);
}

void values_of(const RunStatus& status, Integers& values) {
  std::size_t next = 0;
  const auto add = [&](const auto& fields, const auto& counters) {
    for (const auto& field : fields) {
      values[next++] = static_cast<std::int64_t>(counters.*field.cell);
    }
  };
  add(kRunCounterFields<>, status.counters);
  add(kLossFields, status.losses);
  add(kRightFields, status.rights);
}

bool to_item(const Integers& values, RunStatus& status) {
  std::size_t next = 0;
  bool good = true;
  // A counter that an older recorder lacks is 0.
  const auto take = [&](const auto& fields, auto& counters) {
    for (const auto& field : fields) {
      const std::int64_t value = values[next++] == kMissingValue ? 0 : values[next - 1];
      good = good && value >= 0;
      counters.*field.cell = static_cast<std::uint64_t>(value);
    }
  };
  take(kRunCounterFields<>, status.counters);
  take(kLossFields, status.losses);
  for (const auto& field : kRightFields) {
    good = good && values[next] >= -1;
    status.rights.*field.cell = values[next++];
  }
  return good;
}

bool decode_items(const StreamLayout& layout, std::string_view content, SessionChunk& chunk) {
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count)) return false;
  const auto all = [&] {
    switch (layout.stream->id) {
      case Id::kSpikes:
        return take_items<std::int64_t>(bytes, count, layout, chunk.spikes);
      case Id::kTicks:
        return take_items<double>(bytes, count, layout, chunk.ticks);
      case Id::kSamples:
        return take_items<double>(bytes, count, layout, chunk.samples);
      case Id::kEvents:
        return take_items<std::int64_t>(bytes, count, layout, chunk.events);
      case Id::kStatus:
        return take_items<std::int64_t>(bytes, count, layout, chunk.status);
      case Id::kFrames:
        return take_items<std::int64_t>(bytes, count, layout, chunk.frames);
      case Id::kStimulation:
        return take_items<double>(bytes, count, layout, chunk.commands);
    }
    return false;
  };
  chunk.stream = layout.stream->id;
  return all() && bytes.left() == 0;
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
