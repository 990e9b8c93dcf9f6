#include "drivers/sessions/session_items.hpp"

#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "drivers/sample_limits.hpp"
#include "drivers/sessions/byte_span.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

constexpr std::size_t kMostChannels = 32;
constexpr std::size_t kFrameWords = RawFrame::kMostBytes / sizeof(std::int64_t);
constexpr double kLargestTime_s = 9.2e9;

using Doubles = std::array<double, kMostChannels>;
using Integers = std::array<std::int64_t, kMostChannels>;

/// A whole number from 0 to `largest`, as a double carries it.
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

/// A right of RunStatus: −1 where it is not known.
template <class Whole>
bool to_right(std::int64_t value, Whole& right) {
  if (value < -1 || value > std::numeric_limits<Whole>::max()) return false;
  right = static_cast<Whole>(value);
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

bool to_spike(const Integers& values, SpikeEvent& spike) {
  spike.time = nanoseconds{values[0]};
  return to_whole(values[1], INT32_MAX, spike.neuron) && spike.neuron > 0 &&
         to_whole(values[2], UINT16_MAX, spike.patch) &&
         to_whole(values[3], UINT16_MAX, spike.flags);
}

bool to_event(const Integers& values, LoopEvent& event) {
  event.time = nanoseconds{values[0]};
  event.length = nanoseconds{values[1]};
  return to_whole(values[2], UINT32_MAX, event.subject) &&
         to_whole(values[3], static_cast<std::int64_t>(LoopEvent::Kind::kNeuronReset), event.kind);
}

bool to_tick(const Doubles& values, TickRecord& tick) {
  double latency_ns = values[4];
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

bool to_sample(const Doubles& values, SessionChunk::Sample& item) {
  ProbeSample& sample = item.sample;
  sample.depth_mm = values[5];
  sample.force_mN = values[6];
  sample.x_mm = values[7];
  sample.y_mm = values[8];
  return to_whole(values[0], UINT32_MAX, item.probe) &&
         to_time(values[1], values[2], sample.time) &&
         to_time(values[3], values[4], sample.arrival) && plausible(sample) &&
         to_whole(values[9], UINT32_MAX, sample.sequence) &&
         to_whole(values[10], UINT32_MAX, sample.channels);
}

bool to_status(const Integers& values, RunStatus& status) {
  std::uint64_t* const counters[] = {
      &status.ticks,           &status.overruns,       &status.longest_overrun_ns,
      &status.catch_up_ticks,  &status.gaps,           &status.skipped_ticks,
      &status.spikes,          &status.neuron_resets,  &status.samples,
      &status.samples_dropped, &status.losses.spikes,  &status.losses.ticks,
      &status.losses.events,   &status.losses.samples, &status.losses.frames};
  constexpr std::size_t kRights = std::size(counters);
  for (std::size_t i = 0; i < kRights; ++i) {
    if (!to_whole(values[i], INT64_MAX, *counters[i])) return false;
  }
  RunStatus::Rights& rights = status.rights;
  return to_right(values[kRights], rights.scheduling_class) &&
         to_right(values[kRights + 1], rights.priority) &&
         to_right(values[kRights + 2], rights.cpu) &&
         to_right(values[kRights + 3], rights.locked_memory_kB) &&
         to_right(values[kRights + 4], rights.timer_slack_ns) &&
         to_right(values[kRights + 5], rights.cpu_awake);
}

bool to_frame(const Integers& values, SessionChunk::Frame& item) {
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

/// Decodes the samples of one chunk, each `channels` values of 8 bytes after its stamp.
template <class Values, class Item>
bool take_items(ByteSpan& bytes, std::uint64_t count, std::size_t channels,
                std::vector<Item>& items, bool (*to_item)(const Values&, Item&)) {
  // Each sample takes its values and a byte at least.
  if (count > bytes.left() / (channels * 8 + 1)) return false;
  items.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint8_t stamp_bytes = 0;
    double stamp = 0.0;
    if (!bytes.take(stamp_bytes) || (stamp_bytes != 0 && stamp_bytes != 8) ||
        (stamp_bytes == 8 && !bytes.take(stamp))) {
      return false;
    }
    Values values{};
    for (std::size_t channel = 0; channel < channels; ++channel) {
      if (!bytes.take(values[channel])) return false;
    }
    Item item{};
    if (!to_item(values, item)) return false;
    items.push_back(item);
  }
  return true;
}

}  // namespace

bool decode_items(const SessionStream& stream, std::string_view content, SessionChunk& chunk) {
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count)) return false;
  const std::size_t channels = stream.channels.size();
  const auto all = [&] {
    switch (stream.id) {
      case Id::kSpikes:
        return take_items<Integers>(bytes, count, channels, chunk.spikes, to_spike);
      case Id::kTicks:
        return take_items<Doubles>(bytes, count, channels, chunk.ticks, to_tick);
      case Id::kSamples:
        return take_items<Doubles>(bytes, count, channels, chunk.samples, to_sample);
      case Id::kEvents:
        return take_items<Integers>(bytes, count, channels, chunk.events, to_event);
      case Id::kStatus:
        return take_items<Integers>(bytes, count, channels, chunk.status, to_status);
      case Id::kFrames:
        return take_items<Integers>(bytes, count, channels, chunk.frames, to_frame);
    }
    return false;
  };
  chunk.stream = stream.id;
  return all() && bytes.left() == 0;
}

}  // namespace merkel
