#include "drivers/sessions/session_headers.hpp"

#include <algorithm>
#include <sstream>
#include <string_view>

#include <pugixml.hpp>

#include "core/parameters/parameter_error.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/printable_text.hpp"

namespace merkel {
namespace {

/// XML 1.0 cannot represent most control characters and requires UTF-8.
std::string xml_text(std::string_view text) {
  std::string clean = utf8_text(text);
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

std::string_view format_of(const SessionStream& stream) {
  return stream.integers ? "int64" : "double64";
}

/// A stream's header, whose channels and description are added to `description`.
struct StreamHeader {
  pugi::xml_document document;
  pugi::xml_node info = document.append_child("info");
  pugi::xml_node count;
  pugi::xml_node description;
  pugi::xml_node channels;
  std::size_t added = 0;

  StreamHeader(std::string_view name, std::string_view type, std::string_view format) {
    add(info, "name", name);
    add(info, "type", type);
    count = info.append_child("channel_count");
    add(info, "nominal_srate", "0");  // irregular: each sample has its stamp
    add(info, "channel_format", format);
    add(info, "source_id", name);
    description = info.append_child("desc");
    channels = description.append_child("channels");
  }
  pugi::xml_node channel(std::string_view label) {
    ++added;
    pugi::xml_node made = channels.append_child("channel");
    add(made, "label", label);
    return made;
  }
  void channel(const SessionStream::Channel& each) {
    pugi::xml_node made = channel(each.label);
    add(made, "unit", each.unit);
    if (!each.meaning.empty()) add(made, "meaning", each.meaning);
  }
  std::string text() {
    count.text().set(added);
    return xml_of(document);
  }
};

/// The label of a column of a recording. A name that belongs to a channel gets a prefix.
std::string extra_label(const SessionStream& stream, const std::string& name) {
  const bool taken = std::any_of(stream.channels.begin(), stream.channels.end(),
                                 [&](const auto& channel) { return channel.label == name; });
  return (taken ? "column_" : "") + name;
}

void add_afferents(pugi::xml_node description, const std::vector<AfferentRow>& afferents) {
  pugi::xml_node list = description.append_child("afferents");
  for (const AfferentRow& row : afferents) {
    pugi::xml_node one = list.append_child("afferent");
    for_each_member(row,
                    [&](const char* name, const std::string& value) { add(one, name, value); });
  }
}

}  // namespace

bool is_live(const RunDescription& run, const RunOrigin& origin) {
  constexpr std::chrono::seconds kClose{1};
  for (const auto& [name, value] : run.facts) {
    if (name == "clock_monotonic_ns") return false;
  }
  const ClockPair now = read_clock_pair();
  return origin.utc.count() != 0 &&
         std::chrono::abs((now.utc - now.monotonic) - (origin.utc - origin.start)) < kClose;
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
  if (is_live(run, origin)) add_missing("live", "1");
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

std::string header_with_fact(const std::string& header, std::string_view name,
                             std::string_view value,
                             const std::function<bool(std::string_view)>& replaces) {
  pugi::xml_document document;
  // SessionReader refuses a header that is no XML.
  static_cast<void>(document.load_buffer(header.data(), header.size()));
  pugi::xml_node facts = document.child("info").child("merkel");
  const std::string key(name);
  for (pugi::xml_node fact = facts.child(key.c_str()); fact;) {
    const pugi::xml_node next = fact.next_sibling(key.c_str());
    if (replaces(fact.child_value())) facts.remove_child(fact);
    fact = next;
  }
  add(facts, key.c_str(), value);
  return xml_of(document);
}

std::string stream_header(const SessionStream& stream, const std::vector<AfferentRow>& afferents) {
  StreamHeader header(stream.name, stream.type, format_of(stream));
  for (const SessionStream::Channel& each : stream.channels) header.channel(each);
  if (stream.id == SessionStream::Id::kSpikes) add_afferents(header.description, afferents);
  return header.text();
}

std::string probe_stream_header(const SessionStream& stream, std::uint32_t number,
                                const ProbeInfo& probe) {
  StreamHeader header(stream_name(stream, number), stream.type, format_of(stream));
  for (const SessionStream::Channel& each : stream.channels) {
    if (is_free(each, probe.channels)) header.channel(each);
  }
  if (stream.id == SessionStream::Id::kSamples) {
    for (const std::string& name : probe.extra_columns) {
      add(header.channel(extra_label(stream, name)), "meaning",
          "a column of the recording, not used by the model");
    }
  }
  add(header.description, "probe", probe.title());
  return header.text();
}

std::string states_header(const SessionStream& stream) {
  StreamHeader header(stream.states, "States", format_of(stream));
  for (const SessionStream::Channel& each : stream.channels) {
    if (!is_free(each, 0)) header.channel(each);
  }
  return header.text();
}

std::string mark_header() {
  StreamHeader header(kMarkStreamName, "Markers", "string");
  header.channel("label");
  return header.text();
}

std::string clock_header() {
  StreamHeader header(kClockStreamName, "Clocks", "int64");
  header.channel(
      {.label = "monotonic_ns", .unit = "ns", .meaning = "of the host, as all times here"});
  header.channel({.label = "utc_ns", .unit = "ns", .meaning = "at the same instant, since 1970"});
  return header.text();
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
