#include "drivers/sessions/session_headers.hpp"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string_view>

#include <pugixml.hpp>

#include "core/parameters/parameter_error.hpp"
#include "drivers/clock/clock_pair.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMissing = ProbeSample::kMostExtra;

/// XML 1.0 cannot represent most control characters and requires UTF-8.
std::string xml_text(std::string_view text) {
  std::string clean(text);
  for (char& c : clean) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 && c != '\n' && c != '\t') c = ' ';
  }
  return clean;
}

void add(pugi::xml_node parent, const char* name, std::string_view text) {
  parent.append_child(name).text().set(xml_text(text).c_str());
}

std::string xml_of(const pugi::xml_document& document) {
  std::ostringstream text;
  document.save(text, "", pugi::format_raw);
  return text.str();
}

}  // namespace

ExtraColumns::ExtraColumns(const std::vector<ProbeInfo>& probes) {
  for (const ProbeInfo& probe : probes) {
    for (const std::string& name : probe.extra_columns) {
      if (names_.size() < ProbeSample::kMostExtra &&
          std::find(names_.begin(), names_.end(), name) == names_.end()) {
        names_.push_back(name);
      }
    }
  }
  for (const ProbeInfo& probe : probes) {
    std::vector<std::size_t>& places = places_.emplace_back();
    const auto& own = probe.extra_columns;
    for (const std::string& name : names_) {
      const auto found = std::find(own.begin(), own.end(), name);
      places.push_back(found == own.end() ? kMissing
                                          : static_cast<std::size_t>(found - own.begin()));
    }
  }
}

std::string ExtraColumns::label(std::size_t column) const {
  const auto& own =
      session_streams()[static_cast<std::size_t>(SessionStream::Id::kSamples) - 1].channels;
  const bool taken = std::any_of(
      own.begin(), own.end(), [&](const auto& channel) { return channel.label == names_[column]; });
  return (taken ? "column_" : "") + names_[column];
}

double ExtraColumns::value(std::size_t probe, std::size_t column,
                           const ProbeSample& sample) const noexcept {
  const std::size_t place = probe < places_.size() ? places_[probe][column] : kMissing;
  return place < sample.extra.size() ? sample.extra[place]
                                     : std::numeric_limits<double>::quiet_NaN();
}

std::string session_header(const RunDescription& run, const RunOrigin& origin,
                           const std::string& afferents) {
  pugi::xml_document document;
  pugi::xml_node info = document.append_child("info");
  add(info, "version", "1.0");
  pugi::xml_node facts = info.append_child("merkel");
  for (const auto& [name, value] : run.facts) add(facts, name.c_str(), value);
  add(facts, "scene", run.scene);
  const auto add_missing = [&](const char* name, const std::string& value) {
    if (!value.empty() && !facts.child(name)) add(facts, name, value);
  };
  add_missing("afferents", afferents);
  // An export keeps the clocks of the recording.
  add_missing("start_device_ns", std::to_string(origin.start.count()));
  if (origin.utc.count() != 0) add_missing("start_utc_ns", std::to_string(origin.utc.count()));
  if (!facts.child("clock_monotonic_ns")) {
    const ClockPair clocks = read_clock_pair();
    add(facts, "clock_monotonic_ns", std::to_string(clocks.monotonic.count()));
    add(facts, "clock_utc_ns", std::to_string(clocks.utc.count()));
  }
  return xml_of(document);
}

std::string stream_header(const SessionStream& stream, double rate_Hz, const ExtraColumns& extra) {
  pugi::xml_document document;
  pugi::xml_node info = document.append_child("info");
  add(info, "name", stream.name);
  add(info, "type", stream.type);
  const std::size_t further = stream.id == SessionStream::Id::kSamples ? extra.size() : 0;
  add(info, "channel_count", std::to_string(stream.channels.size() + further));
  add(info, "nominal_srate", shortest_decimal(rate_Hz));
  add(info, "channel_format", stream.integers ? "int64" : "double64");
  add(info, "source_id", stream.name);
  pugi::xml_node channels = info.append_child("desc").append_child("channels");
  for (const SessionStream::Channel& each : stream.channels) {
    pugi::xml_node channel = channels.append_child("channel");
    add(channel, "label", each.label);
    add(channel, "unit", each.unit);
    if (!each.meaning.empty()) add(channel, "meaning", each.meaning);
  }
  for (std::size_t i = 0; i < further; ++i) {
    pugi::xml_node channel = channels.append_child("channel");
    add(channel, "label", extra.label(i));
    add(channel, "meaning", "a column of the recording, not used by the model");
  }
  return xml_of(document);
}

std::string mark_header() {
  pugi::xml_document document;
  pugi::xml_node info = document.append_child("info");
  add(info, "name", kMarkStreamName);
  add(info, "type", "Markers");
  add(info, "channel_count", "1");
  add(info, "nominal_srate", "0");
  add(info, "channel_format", "string");
  add(info, "source_id", kMarkStreamName);
  return xml_of(document);
}

std::string stream_footer(const StreamTally& tally) {
  pugi::xml_document document;
  pugi::xml_node info = document.append_child("info");
  info.append_child("first_timestamp").text().set(tally.first_s);
  info.append_child("last_timestamp").text().set(tally.last_s);
  add(info, "sample_count", std::to_string(tally.samples));
  return xml_of(document);
}

}  // namespace merkel
