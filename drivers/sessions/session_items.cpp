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
#include <type_traits>

#include "drivers/sample_limits.hpp"
#include "drivers/sessions/byte_span.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

constexpr std::size_t kFrameWords = RawFrame::kMostBytes / sizeof(std::int64_t);
constexpr double kLargestTime_s =
    4e9;  ///< the difference of two times fits into 64-bit nanoseconds
constexpr std::int8_t kMissingValue = -1;  ///< for a channel that the file lacks

using Doubles = ItemValues<double>;
using Integers = ItemValues<std::int64_t>;

/// A whole number from 0 to `largest`, stored as a double.
template <class Whole>
bool to_whole(double value, double largest, Whole& whole) {
  if (!(value >= 0.0 && value <= largest) || value != std::floor(value)) return false;
  whole = static_cast<Whole>(value);
  return true;
}

template <class Whole>
bool to_whole(std::int64_t value, std::int64_t largest, Whole& whole) {
  if (value < 0 || value > largest) return false;
  whole = static_cast<Whole>(value);
  return true;
}

bool to_time(double whole_s, double rest_ns, nanoseconds& time) {
  std::int64_t rest = 0;
  if (!(std::fabs(whole_s) <= kLargestTime_s) || whole_s != std::floor(whole_s) ||
      !to_whole(rest_ns, 999'999'999.0, rest)) {
    return false;
  }
  time = std::chrono::seconds{static_cast<std::int64_t>(whole_s)} + nanoseconds{rest};
  return true;
}

struct SplitTime {
  double whole_s;
  double rest_ns;
};

SplitTime split(nanoseconds time) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  return {.whole_s = static_cast<double>(whole.count()),
          .rest_ns = static_cast<double>((time - whole).count())};
}

template <class Value, std::size_t size>
void set(ItemValues<Value>& values, const std::array<Value, size>& first) {
  std::copy(first.begin(), first.end(), values.begin());
}

std::int64_t whole(std::uint64_t value) { return static_cast<std::int64_t>(value); }

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
    if constexpr (std::is_same_v<Item, SessionChunk::Sample>) {
      for (std::size_t k = 0; k < layout.extra.size(); ++k) {
        items.back().sample.extra[k] = in_file[layout.extra[k]];
      }
    }
  }
  return true;
}

}  // namespace

void values_of(const SpikeEvent& spike, Integers& values) {
  set(values,
      std::array<std::int64_t, 4>{spike.time.count(), spike.neuron, spike.patch, spike.flags});
}

bool to_item(const Integers& values, SpikeEvent& spike) {
  spike.time = nanoseconds{values[0]};
  return to_whole(values[1], INT32_MAX, spike.neuron) && spike.neuron > 0 &&
         to_whole(values[2], UINT16_MAX, spike.patch) &&
         to_whole(values[3], UINT16_MAX, spike.flags);
}

void values_of(const LoopEvent& event, Integers& values) {
  set(values, std::array<std::int64_t, 4>{event.time.count(), event.length.count(), event.subject,
                                          static_cast<std::int64_t>(event.kind)});
}

bool to_item(const Integers& values, LoopEvent& event) {
  event.time = nanoseconds{values[0]};
  event.length = nanoseconds{values[1]};
  return to_whole(values[2], UINT32_MAX, event.subject) &&
         to_whole(values[3], static_cast<std::int64_t>(LoopEvent::Kind::kNeuronReset), event.kind);
}

void values_of(const TickRecord& tick, Doubles& values) {
  const SplitTime time = split(tick.time);
  set(values, std::array<double, 11>{
                  static_cast<double>(tick.number), static_cast<double>(tick.probe), time.whole_s,
                  time.rest_ns, static_cast<double>(tick.latency.count()), tick.contact.depth_mm,
                  tick.contact.force_mN, tick.contact.x_mm, tick.contact.y_mm,
                  static_cast<double>(tick.late), static_cast<double>(tick.state)});
}

bool to_item(const Doubles& values, TickRecord& tick) {
  const double latency_ns = values[4];
  if (!(std::fabs(latency_ns) < 9e18)) return false;
  tick.latency = nanoseconds{static_cast<std::int64_t>(latency_ns)};
  tick.contact = {
      .depth_mm = values[5], .force_mN = values[6], .x_mm = values[7], .y_mm = values[8]};
  return to_whole(values[0], 9e15, tick.number) && to_whole(values[1], UINT32_MAX, tick.probe) &&
         to_time(values[2], values[3], tick.time) &&
         plausible(tick.contact.depth_mm, SampleLimits::kDepth_mm) &&
         plausible(tick.contact.force_mN, SampleLimits::kForce_mN) &&
         plausible(tick.contact.x_mm, SampleLimits::kPosition_mm) &&
         plausible(tick.contact.y_mm, SampleLimits::kPosition_mm) &&
         to_whole(values[9], UINT16_MAX, tick.late) &&
         to_whole(values[10], static_cast<double>(TickRecord::State::kEnded), tick.state);
}

void values_of(const SessionChunk::Sample& item, Doubles& values) {
  const ProbeSample& sample = item.sample;
  const SplitTime time = split(sample.time);
  const SplitTime arrival = split(sample.arrival);
  set(values, std::array<double, 12>{
                  static_cast<double>(item.probe), time.whole_s, time.rest_ns, arrival.whole_s,
                  arrival.rest_ns, sample.depth_mm, sample.force_mN, sample.x_mm, sample.y_mm,
                  static_cast<double>(sample.sequence), static_cast<double>(sample.channels),
                  static_cast<double>(sample.valid_for.count())});
}

bool to_item(const Doubles& values, SessionChunk::Sample& item) {
  ProbeSample& sample = item.sample;
  sample.depth_mm = values[5];
  sample.force_mN = values[6];
  sample.x_mm = values[7];
  sample.y_mm = values[8];
  // Older files do not have it.
  const double valid_for_ns = values[11] == kMissingValue ? 0.0 : values[11];
  std::int64_t valid_for = 0;
  const bool good =
      to_whole(values[0], UINT32_MAX, item.probe) && to_time(values[1], values[2], sample.time) &&
      to_time(values[3], values[4], sample.arrival) && plausible(sample) &&
      to_whole(values[9], UINT32_MAX, sample.sequence) &&
      to_whole(values[10], UINT32_MAX, sample.channels) && to_whole(valid_for_ns, 9e15, valid_for);
  sample.valid_for = nanoseconds{valid_for};
  return good;
}

void values_of(const RunStatus& status, Integers& values) {
  std::size_t next = 0;
  for (const auto& field : kRunCounterFields<>) {
    values[next++] = whole(status.counters.*field.cell);
  }
  for (const auto& field : kLossFields) values[next++] = whole(status.losses.*field.cell);
  for (const auto& field : kRightFields) values[next++] = status.rights.*field.cell;
}

bool to_item(const Integers& values, RunStatus& status) {
  std::size_t next = 0;
  const auto to_count = [&](std::uint64_t& count) {
    const std::int64_t value = values[next++];
    // A counter that an older recorder lacks is 0.
    return to_whole(value == kMissingValue ? 0 : value, INT64_MAX, count);
  };
  for (const auto& field : kRunCounterFields<>) {
    if (!to_count(status.counters.*field.cell)) return false;
  }
  for (const auto& field : kLossFields) {
    if (!to_count(status.losses.*field.cell)) return false;
  }
  for (const auto& field : kRightFields) {
    if (values[next] < -1) return false;
    status.rights.*field.cell = values[next++];
  }
  return true;
}

void values_of(const SessionChunk::Frame& item, Integers& values) {
  const RawFrame& frame = item.frame;
  set(values, std::array<std::int64_t, 8>{item.probe, item.port, frame.time.count(),
                                          static_cast<std::int64_t>(frame.kind), frame.length,
                                          frame.parsed, frame.damaged, frame.lost});
  std::memcpy(&values[8], frame.bytes.data(), kFrameWords * sizeof(std::int64_t));
}

bool to_item(const Integers& values, SessionChunk::Frame& item) {
  RawFrame& frame = item.frame;
  frame.time = nanoseconds{values[2]};
  std::memcpy(frame.bytes.data(), &values[8], kFrameWords * sizeof(std::int64_t));
  return to_whole(values[0], UINT32_MAX, item.probe) &&
         to_whole(values[1], UINT32_MAX, item.port) &&
         to_whole(values[3], static_cast<std::int64_t>(RawFrame::Kind::kStarted), frame.kind) &&
         to_whole(values[4], static_cast<std::int64_t>(RawFrame::kMostBytes), frame.length) &&
         to_whole(values[5], UINT32_MAX, frame.parsed) &&
         to_whole(values[6], UINT32_MAX, frame.damaged) &&
         to_whole(values[7], UINT32_MAX, frame.lost);
}

void values_of(const StimulationCommand& command, Doubles& values) {
  const SplitTime time = split(command.time);
  set(values, std::array<double, 8>{
                  time.whole_s, time.rest_ns, static_cast<double>(command.electrode),
                  static_cast<double>(command.kind), command.amplitude_uA, command.frequency_Hz,
                  static_cast<double>(command.heartbeat), static_cast<double>(command.stop)});
}

bool to_item(const Doubles& values, StimulationCommand& command) {
  constexpr double kLargestValue = 1e6;  // far above the limits of scenes
  command.amplitude_uA = values[4];
  command.frequency_Hz = values[5];
  return to_time(values[0], values[1], command.time) &&
         to_whole(values[2], UINT16_MAX, command.electrode) &&
         to_whole(values[3], static_cast<double>(StimulationCommand::Kind::kPulse), command.kind) &&
         command.amplitude_uA >= 0.0 && command.amplitude_uA <= kLargestValue &&
         command.frequency_Hz >= 0.0 && command.frequency_Hz <= kLargestValue &&
         to_whole(values[6], UINT32_MAX, command.heartbeat) &&
         to_whole(values[7], static_cast<double>(StimulationCommand::Stop::kEnd), command.stop);
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
        !(std::fabs(stamp_s) <= kLargestTime_s) || !bytes.take_count(length) ||
        !bytes.take_text(length, label)) {
      return false;
    }
    const nanoseconds time{static_cast<std::int64_t>(std::llround(stamp_s * 1e9))};
    chunk.marks.push_back({.time = time, .label = std::string(label)});
  }
  return bytes.left() == 0;
}

}  // namespace merkel
