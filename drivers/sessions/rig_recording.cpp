#include "drivers/sessions/rig_recording.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <system_error>

#include <pugixml.hpp>

#include "core/units.hpp"
#include "drivers/sample_limits.hpp"
#include "drivers/sessions/byte_span.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr double kFarthest_s = 4e9;  ///< the difference of two times fits into 64-bit ns
constexpr double kClosing_s = 2.0;   ///< longest time from the end of a run to its closed outlets

std::optional<std::int64_t> whole_of(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_time(double time_s) { return std::fabs(time_s) <= kFarthest_s; }

nanoseconds ns_of(double time_s) { return nanoseconds{std::llround(time_s * 1e9)}; }

}  // namespace

std::pair<std::string, std::string> split_rig(const std::string& path) {
  std::error_code ignored;
  const auto at = path.rfind('@');
  if (at == std::string::npos || std::filesystem::exists(path, ignored)) return {path, ""};
  return {path.substr(0, at), path.substr(at + 1)};
}

/// What the file says of its streams, by number.
struct RigRecording::Found {
  std::map<std::uint32_t, std::unique_ptr<pugi::xml_document>> headers;
  std::map<std::uint32_t, std::vector<std::pair<double, double>>> offsets;
  std::map<std::uint32_t, double> first_s;
  std::map<std::uint32_t, std::vector<double>> ends_s;

  [[nodiscard]] pugi::xml_node info(std::uint32_t number) const {
    return headers.at(number)->child("info");
  }
  [[nodiscard]] bool is_marks(std::uint32_t number) const {
    if (!headers.contains(number)) return false;
    const std::string name = info(number).child_value("name");
    return name.ends_with(".marks") &&
           std::string_view(info(number).child_value("channel_format")) == "string" &&
           info(number).child_value("source_id") == std::string(kRigSource) + name;
  }
  /// The rigs: the streams of spikes.
  [[nodiscard]] std::vector<std::uint32_t> rigs() const {
    std::vector<std::uint32_t> numbers;
    for (const auto& [number, header] : headers) {
      const std::string name = info(number).child_value("name");
      if (std::string_view(info(number).child_value("type")) == "Spikes" &&
          info(number).child_value("source_id") == std::string(kRigSource) + name) {
        numbers.push_back(number);
      }
    }
    return numbers;
  }
};

Expected<bool, SetupError> RigRecording::read(XdfFile& file, std::string_view rig) {
  Found found;
  XdfChunk chunk;
  file.rewind();
  for (;;) {
    const auto more = file.next(chunk);
    if (!more) return more;
    if (!*more) break;
    ByteSpan bytes(chunk.content);
    std::uint32_t number = 0;
    if (chunk.tag == XdfTag::kFileHeader || !bytes.take(number)) continue;
    double time_s = 0.0;
    double offset_s = 0.0;
    if (chunk.tag == XdfTag::kStreamHeader) {
      auto header = std::make_unique<pugi::xml_document>();
      if (!header->load_buffer(chunk.content.data() + sizeof number, bytes.left())) {
        return file.damaged("a stream's header is not XML");
      }
      found.headers[number] = std::move(header);
    } else if (chunk.tag == XdfTag::kClockOffset) {
      if (!bytes.take(time_s) || !bytes.take(offset_s) || !is_time(time_s) || !is_time(offset_s)) {
        return file.damaged("an offset of clocks has an invalid value");
      }
      found.offsets[number].emplace_back(time_s, offset_s);
    } else if (chunk.tag == XdfTag::kSamples) {
      const std::string_view content(chunk.content.data() + sizeof number, bytes.left());
      if (!found.first_s.contains(number)) {
        std::uint64_t count = 0;
        std::uint8_t stamp = 0;
        if (bytes.take_count(count) && count > 0 && bytes.take(stamp) && stamp == sizeof time_s &&
            bytes.take(time_s)) {
          found.first_s[number] = time_s;
        }
      }
      if (!found.is_marks(number)) continue;
      const auto note_end = [&](double stamp_s, std::string_view label) {
        if (label == kRigEnd) found.ends_s[number].push_back(stamp_s);
      };
      if (!for_each_row({.kind = Stream::Kind::kMarks}, content, note_end)) {
        return file.damaged("its marks have another form than merkel's");
      }
    }
  }
  file.rewind();
  const auto rigs = found.rigs();
  if (rigs.empty()) return false;
  std::string names;
  const auto name_of_rig = [&](std::uint32_t number) {
    return std::string(found.info(number).child_value("name"));
  };
  for (const std::uint32_t number : rigs) {
    names.append(names.empty() ? "" : ", ").append(name_of_rig(number));
  }
  std::optional<std::string> chosen;
  if (rig.empty() && rigs.size() == 1) chosen = name_of_rig(rigs[0]);
  for (const std::uint32_t number : rigs) {
    if (name_of_rig(number) == rig) chosen = rig;
  }
  if (!chosen) {
    return bad_input(file.path() +
                     (rig.empty() ? " is a recording of the rigs "
                                  : " has no rig " + std::string(rig) + ", but ") +
                     names + ": choose one, " + file.path() + "@" + name_of_rig(rigs[0]));
  }
  if (auto taken = take(found, *chosen); !taken) return Unexpected<SetupError>(taken.error());
  facts_.emplace_back("recorder", file.path());
  return true;
}

Expected<void, SetupError> RigRecording::take(const Found& found, const std::string& rig) {
  double start_s = std::numeric_limits<double>::infinity();
  double error_s = 0.0;
  pugi::xml_node description;
  ClockLine clock;
  for (const auto& [number, header] : found.headers) {
    const pugi::xml_node info = found.info(number);
    const std::string name = info.child_value("name");
    if (info.child_value("source_id") != std::string(kRigSource) + name) continue;
    const auto offsets = found.offsets.find(number);
    const ClockLine line =
        offsets == found.offsets.end() ? ClockLine{} : ClockLine::through(offsets->second);
    // All rigs count from the first sample of the file.
    const auto first = found.first_s.find(number);
    if (first != found.first_s.end()) start_s = std::min(start_s, line(first->second));
    if (name != rig && !name.starts_with(rig + ".")) continue;
    Stream stream;
    const std::string part = name == rig ? "" : name.substr(rig.size() + 1);
    const std::string_view format = info.child_value("channel_format");
    if (part.empty() && format == "int32") {
      description = info.child("desc");
    } else if (part.starts_with("samples") && format == "double64") {
      stream.kind = Stream::Kind::kSamples;
      const auto probe = part == "samples" ? 0 : whole_of(part.substr(part.rfind('.') + 1));
      stream.probe = static_cast<std::uint32_t>(
          std::clamp<std::int64_t>(probe.value_or(0), 0, kMaxSessionProbes - 1));
      for (const pugi::xml_node& each : info.child("desc").child("channels").children("channel")) {
        stream.labels.emplace_back(each.child_value("label"));
      }
    } else if (part == "marks" && format == "string") {
      stream.kind = Stream::Kind::kMarks;
      const auto ends = found.ends_s.find(number);
      if (ends != found.ends_s.end()) ends_s_ = ends->second;
    } else {
      continue;
    }
    if (part.empty()) clock = line;
    stream.clock = line;
    error_s = std::max(error_s, line.residual_s);
    streams_[number] = std::move(stream);
  }
  // The clock of the rig is that of the facts.
  std::int64_t monotonic_ns = 0;
  std::int64_t utc_ns = 0;
  for (const pugi::xml_node& node : description.child("merkel")) {
    const std::string_view name = node.name();
    if (name == "clock_monotonic_ns") monotonic_ns = whole_of(node.child_value()).value_or(0);
    if (name == "clock_utc_ns") utc_ns = whole_of(node.child_value()).value_or(0);
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

/// Passes the stamp and the values of each sample; of a mark, its label. False if they are not of
/// the stream's form. merkel stamps every sample.
template <class Take>
bool RigRecording::for_each_row(const Stream& stream, std::string_view content, Take take) {
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count) || count > bytes.left()) return false;
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint8_t stamped = 0;
    double stamp_s = 0.0;
    if (!bytes.take(stamped) || stamped != sizeof stamp_s || !bytes.take(stamp_s)) return false;
    std::uint64_t length = stream.kind == Stream::Kind::kSpikes
                               ? sizeof(std::int32_t)
                               : sizeof(double) * stream.labels.size();
    if (stream.kind == Stream::Kind::kMarks && !bytes.take_count(length)) return false;
    std::string_view values;
    if (!bytes.take_text(length, values)) return false;
    take(stamp_s, values);
  }
  return bytes.left() == 0;
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
  const auto decode = [&](double stamp_s, std::string_view row) {
    const double time_s = stream.clock(stamp_s);
    if (!is_time(time_s)) {
      in_range = false;
    } else if (!is_stale(stamp_s)) {
      decode_row(stream, ns_of(time_s), row, chunk);
    }
  };
  return for_each_row(stream, content, decode) && in_range;
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
                         .sample = {.time = time, .arrival = time, .sequence = stream.sequence}};
    for (const std::string& label : stream.labels) {
      double value = 0.0;
      if (!values.take(value)) return;
      const auto set = [&](std::uint32_t channel, double& member, double to) {
        member = to;
        item.sample.channels |= channel;
      };
      if (label == "depth") set(ProbeSample::kDepth, item.sample.depth_mm, value);
      if (label == "force") {
        set(ProbeSample::kForce, item.sample.force_mN, units::mN_from_N(value));
      }
      if (label == "x") set(ProbeSample::kX, item.sample.x_mm, value);
      if (label == "y") set(ProbeSample::kY, item.sample.y_mm, value);
    }
    if (!plausible(item.sample)) return;
    ++stream.sequence;
    chunk.samples.push_back(item);
  }
}

}  // namespace merkel
