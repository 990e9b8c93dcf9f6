#include "drivers/sessions/rig_recording.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <system_error>

#include <pugixml.hpp>

#include "core/parameters/nearest_name.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sample_limits.hpp"
#include "drivers/sample_source.hpp"
#include "drivers/sessions/byte_span.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr double kFarthest_s = 4e9;  ///< the difference of two times fits into 64-bit ns
constexpr double kClosing_s = 2.0;   ///< longest time from the end of a run to its closed outlets

bool is_time(double time_s) { return std::fabs(time_s) <= kFarthest_s; }

nanoseconds ns_of(double time_s) { return nanoseconds{std::llround(time_s * 1e9)}; }

}  // namespace

std::pair<std::string, std::string> split_rig(const std::string& path) {
  std::error_code ignored;
  const auto at = path.rfind('@');
  if (at == std::string::npos || std::filesystem::exists(path, ignored)) return {path, ""};
  return {path.substr(0, at), path.substr(at + 1)};
}

/// A stream that a sink lsl: has sent.
struct RigRecording::Found {
  XdfStream samples;
  pugi::xml_document header;
  std::optional<double> first_s = {};
  std::vector<double> ends_s = {};

  [[nodiscard]] pugi::xml_node info() const { return header.child("info"); }
};

Expected<bool, SetupError> RigRecording::read(XdfFile& file, std::string_view rig) {
  std::map<std::uint32_t, double> first_s;
  std::map<std::uint32_t, std::vector<double>> ends_s;
  auto streams =
      read_xdf_streams(file, [&](std::uint32_t number, const XdfStream& stream, const auto& row) {
        first_s.try_emplace(number, stream.stamp_s);
        if (row.front() == kRigEnd) ends_s[number].push_back(stream.stamp_s);
      });
  file.rewind();
  if (!streams) return Unexpected<SetupError>(streams.error());
  std::map<std::uint32_t, Found> found;
  std::vector<std::string> rigs;  // the streams of spikes
  for (auto& [number, stream] : *streams) {
    Found each{.samples = std::move(stream), .header = {}};
    static_cast<void>(each.header.load_string(each.samples.header.c_str()));
    if (each.info().child_value("source_id") != std::string(kRigSource) + each.samples.name)
      continue;
    if (first_s.contains(number)) each.first_s = first_s[number];
    each.ends_s = std::move(ends_s[number]);
    if (std::string_view(each.info().child_value("type")) == "Spikes") {
      rigs.push_back(each.samples.name);
    }
    found.emplace(number, std::move(each));
  }
  if (rigs.empty()) return false;
  const bool only = rig.empty() && rigs.size() == 1;
  if (!only && std::ranges::find(rigs, rig) == rigs.end()) {
    return bad_input(file.path() +
                     (rig.empty() ? " is a recording of the rigs "
                                  : " has no rig " + std::string(rig) + ", but ") +
                     listed(rigs) + ": choose one, " + file.path() + "@" + rigs[0]);
  }
  if (auto taken = take(found, only ? rigs[0] : std::string(rig)); !taken)
    return Unexpected<SetupError>(taken.error());
  facts_.emplace_back("recorder", file.path());
  return true;
}

Expected<void, SetupError> RigRecording::take(const std::map<std::uint32_t, Found>& found,
                                              const std::string& rig) {
  double start_s = std::numeric_limits<double>::infinity();
  double error_s = 0.0;
  pugi::xml_node description;
  ClockLine clock;
  for (const auto& [number, each] : found) {
    const pugi::xml_node info = each.info();
    const std::string& name = each.samples.name;
    const auto line = ClockLine::through(each.samples.offsets, name);
    // All rigs count from the first sample of the file.
    if (line && each.first_s) start_s = std::min(start_s, (*line)(*each.first_s));
    if (name != rig && !name.starts_with(rig + ".")) continue;
    if (!line) return Unexpected<SetupError>(line.error());
    Stream stream{.samples = each.samples};
    stream.samples.stamp_s = 0.0;
    const std::string part = name == rig ? "" : name.substr(rig.size() + 1);
    const std::string& format = each.samples.format;
    if (part.empty() && format == "int32") {
      description = info.child("desc");
    } else if (part.starts_with("samples") && format == "double64") {
      stream.kind = Stream::Kind::kSamples;
      const auto probe =
          part == "samples" ? 0 : parsed_number<std::int64_t>(part.substr(part.rfind('.') + 1));
      stream.probe = static_cast<std::uint32_t>(
          std::clamp<std::int64_t>(probe.value_or(0), 0, kMaxSessionProbes - 1));
      for (const pugi::xml_node& one : info.child("desc").child("channels").children("channel")) {
        stream.labels.emplace_back(one.child_value("label"));
      }
    } else if (part == "marks" && format == "string") {
      stream.kind = Stream::Kind::kMarks;
      ends_s_ = each.ends_s;
    } else {
      continue;
    }
    if (part.empty()) clock = *line;
    stream.clock = *line;
    error_s = std::max(error_s, line->residual_s);
    streams_[number] = std::move(stream);
  }
  // The clock of the rig is that of the facts.
  std::int64_t monotonic_ns = 0;
  std::int64_t utc_ns = 0;
  for (const pugi::xml_node& node : description.child("merkel")) {
    const std::string_view name = node.name();
    if (name == "clock_monotonic_ns")
      monotonic_ns = parsed_number<std::int64_t>(node.child_value()).value_or(0);
    if (name == "clock_utc_ns")
      utc_ns = parsed_number<std::int64_t>(node.child_value()).value_or(0);
    facts_.emplace_back(name, node.child_value());
  }
  for (const pugi::xml_node& each : description.child("afferents").children("afferent")) {
    patches_.push_back(static_cast<std::uint16_t>(each.child("patch").text().as_uint()));
  }
  const nanoseconds start = ns_of(is_time(start_s) ? start_s : 0.0);
  facts_.emplace_back("rig", rig);
  facts_.emplace_back("start_device_ns", std::to_string(start.count()));
  facts_.emplace_back("clock_error_ns", std::to_string(ns_of(error_s).count()));
  const double clock_s = clock(static_cast<double>(monotonic_ns) * 1e-9);
  if (utc_ns != 0 && is_time(clock_s)) {
    const nanoseconds utc = nanoseconds{utc_ns} + (start - ns_of(clock_s));
    facts_.emplace_back("start_utc_ns", std::to_string(utc.count()));
  }
  return {};
}

bool RigRecording::is_stale(double stamp_s) const {
  return std::any_of(ends_s_.begin(), ends_s_.end(), [stamp_s](double end_s) {
    return stamp_s > end_s && stamp_s < end_s + kClosing_s;
  });
}

bool RigRecording::decode(std::uint32_t number, std::string_view content, SessionChunk& chunk) {
  const auto found = streams_.find(number);
  if (found == streams_.end()) return true;
  Stream& stream = found->second;
  using Id = SessionStream::Id;
  chunk.stream = stream.kind == Stream::Kind::kSamples ? Id::kSamples : Id::kSpikes;
  bool in_range = true;
  const auto decode = [&](std::span<const std::string_view> row) {
    const double stamp_s = stream.samples.stamp_s;
    const double time_s = stream.clock(stamp_s);
    if (!is_time(time_s)) {
      in_range = false;
    } else if (!is_stale(stamp_s)) {
      decode_row(stream, ns_of(time_s), row.front(), chunk);
    }
  };
  return stream.samples.for_each_sample(content, decode) && in_range;
}

/// Leaves out what merkel does not send: a stale sample of a run whose end was not recorded.
void RigRecording::decode_row(Stream& stream, nanoseconds time, std::string_view row,
                              SessionChunk& chunk) const {
  ByteSpan values(row);
  if (stream.kind == Stream::Kind::kSpikes) {
    std::int32_t neuron = 0;
    if (!values.take(neuron) || neuron < 1) return;
    const auto place = static_cast<std::size_t>(neuron) - 1;
    chunk.spikes.push_back({.time = time,
                            .neuron = static_cast<std::uint32_t>(neuron),
                            .patch = place < patches_.size() ? patches_[place] : std::uint16_t{0}});
  } else if (stream.kind == Stream::Kind::kMarks) {
    if (row != kRigEnd) chunk.marks.push_back({.time = time, .label = std::string(row)});
  } else {
    DeliveredSample item{.probe = stream.probe,
                         .sample = {.time = time,
                                    .arrival = time,
                                    .sequence = stream.sequence,
                                    .valid_for = SampleSource::kNotStated}};
    for (const std::string& label : stream.labels) {
      double value = 0.0;
      if (!values.take(value)) return;
      for (const SampleChannel& channel : kProbeChannels) {
        if (label != channel.name) continue;
        channel.set(item.sample, value);
        item.sample.channels |= channel.bit;
      }
    }
    if (!plausible(item.sample)) return;
    ++stream.sequence;
    chunk.samples.push_back(item);
  }
}

}  // namespace merkel
