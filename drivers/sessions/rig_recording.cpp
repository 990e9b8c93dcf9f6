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

constexpr double kRobust_s = 1e-4;  ///< an offset further from the line counts less
constexpr int kMostSteps = 200;
constexpr double kFarthest_s = 4e9;  ///< the difference of two times fits into 64-bit ns
constexpr std::string_view kSource = "merkel-";  ///< of the streams of the sink lsl:

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

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

ClockLine ClockLine::through(const std::vector<std::pair<double, double>>& offsets) {
  if (offsets.empty()) return {};
  if (offsets.size() == 1) return {.offset_s = offsets[0].second};
  double middle_s = offsets[0].first;
  for (const auto& [time_s, offset_s] : offsets) middle_s = std::min(middle_s, time_s);
  std::vector<double> weights(offsets.size(), 1.0);
  std::vector<double> residuals(offsets.size());
  double at_middle = 0.0;
  double drift = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    double w = 0.0;
    double wx = 0.0;
    double wy = 0.0;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      w += weights[i];
      wx += weights[i] * (offsets[i].first - middle_s);
      wy += weights[i] * offsets[i].second;
    }
    double xx = 0.0;
    double xy = 0.0;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      const double x = offsets[i].first - middle_s - wx / w;
      xx += weights[i] * x * x;
      xy += weights[i] * x * (offsets[i].second - wy / w);
    }
    const double before = at_middle;
    const double drift_before = drift;
    drift = xx > 0.0 ? xy / xx : 0.0;
    at_middle = wy / w - drift * wx / w;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      residuals[i] =
          std::fabs(offsets[i].second - at_middle - drift * (offsets[i].first - middle_s));
      weights[i] = kRobust_s / std::max(residuals[i], kRobust_s);
    }
    if (std::fabs(at_middle - before) < 1e-13 && std::fabs(drift - drift_before) < 1e-15) break;
  }
  return {
      .offset_s = at_middle - drift * middle_s, .drift = drift, .residual_s = median_of(residuals)};
}

/// What the file says of its streams, by number.
struct RigRecording::Found {
  std::map<std::uint32_t, std::unique_ptr<pugi::xml_document>> headers;
  std::map<std::uint32_t, std::vector<std::pair<double, double>>> offsets;
  std::map<std::uint32_t, double> first_s;

  [[nodiscard]] pugi::xml_node info(std::uint32_t number) const {
    return headers.at(number)->child("info");
  }
  /// The rigs: the streams of spikes.
  [[nodiscard]] std::vector<std::uint32_t> rigs() const {
    std::vector<std::uint32_t> numbers;
    for (const auto& [number, header] : headers) {
      const std::string name = info(number).child_value("name");
      if (std::string_view(info(number).child_value("type")) == "Spikes" &&
          info(number).child_value("source_id") == std::string(kSource) + name) {
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
    } else if (chunk.tag == XdfTag::kSamples && !found.first_s.contains(number)) {
      std::uint64_t count = 0;
      std::uint8_t stamp = 0;
      if (bytes.take_count(count) && count > 0 && bytes.take(stamp) && stamp == sizeof time_s &&
          bytes.take(time_s)) {
        found.first_s[number] = time_s;
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
    if (info.child_value("source_id") != std::string(kSource) + name) continue;
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
          std::clamp<std::int64_t>(probe.value_or(0), 0, kMostSessionProbes - 1));
      for (const pugi::xml_node& each : info.child("desc").child("channels").children("channel")) {
        stream.labels.emplace_back(each.child_value("label"));
      }
    } else if (part == "marks" && format == "string") {
      stream.kind = Stream::Kind::kMarks;
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

bool RigRecording::decode(std::uint32_t number, std::string_view content, SessionChunk& chunk) {
  const auto found = streams_.find(number);
  if (found == streams_.end()) return true;
  Stream& stream = found->second;
  using Id = SessionStream::Id;
  chunk.stream = stream.kind == Stream::Kind::kSamples ? Id::kSamples : Id::kSpikes;
  ByteSpan bytes(content);
  std::uint64_t count = 0;
  if (!bytes.take_count(count) || count > bytes.left()) return false;
  std::string_view rest;
  if (!bytes.take_text(bytes.left(), rest)) return false;
  for (std::uint64_t i = 0; i < count; ++i) {
    // merkel stamps every sample.
    ByteSpan row(rest);
    std::uint8_t stamped = 0;
    double stamp_s = 0.0;
    if (!row.take(stamped) || stamped != sizeof stamp_s || !row.take(stamp_s)) return false;
    const double time_s = stream.clock(stamp_s);
    if (!is_time(time_s)) return false;
    rest.remove_prefix(1 + sizeof stamp_s);
    if (!decode_row(stream, ns_of(time_s), rest, chunk)) return false;
  }
  return rest.empty();
}

bool RigRecording::decode_row(Stream& stream, nanoseconds time, std::string_view& rest,
                              SessionChunk& chunk) const {
  ByteSpan row(rest);
  if (stream.kind == Stream::Kind::kSpikes) {
    std::int32_t neuron = 0;
    if (!row.take(neuron) || neuron < 1) return false;
    const auto place = static_cast<std::size_t>(neuron) - 1;
    chunk.spikes.push_back({.time = time,
                            .neuron = static_cast<std::uint32_t>(neuron),
                            .patch = place < patches_.size() ? patches_[place] : std::uint16_t{0}});
  } else if (stream.kind == Stream::Kind::kMarks) {
    std::uint64_t length = 0;
    std::string_view label;
    if (!row.take_count(length) || !row.take_text(length, label)) return false;
    chunk.marks.push_back({.time = time, .label = std::string(label)});
  } else {
    DeliveredSample item{.probe = stream.probe,
                         .sample = {.time = time, .arrival = time, .sequence = stream.sequence++}};
    for (const std::string& label : stream.labels) {
      double value = 0.0;
      if (!row.take(value)) return false;
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
    if (!plausible(item.sample)) return false;
    chunk.samples.push_back(item);
  }
  rest.remove_prefix(rest.size() - row.left());
  return true;
}

}  // namespace merkel
