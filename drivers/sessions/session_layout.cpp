#include "drivers/sessions/session_layout.hpp"

#include <algorithm>

#include <pugixml.hpp>

#include "core/records/readings.hpp"

namespace merkel {

std::optional<NamedStream> stream_named(std::string_view name) {
  for (const SessionStream& stream : session_streams()) {
    if (name == stream.name) return NamedStream{.stream = &stream};
    if (!stream.of_probe()) continue;
    if (name == stream.states) return NamedStream{.stream = &stream, .states = true};
    for (std::uint32_t probe = 1; probe < kMaxSessionProbes; ++probe) {
      if (name == stream_name(stream, probe)) return NamedStream{.stream = &stream, .probe = probe};
    }
  }
  return std::nullopt;
}

Expected<StreamLayout, std::string> layout_of(const NamedStream& named, const pugi::xml_node& info,
                                              std::vector<std::string>& extra_columns) {
  const SessionStream& stream = *named.stream;
  const auto wrong = [&](const std::string& what) {
    return Unexpected<std::string>("its stream " + std::string(info.child_value("name")) + " " +
                                   what);
  };
  StreamLayout layout{named};
  layout.channels = info.child("channel_count").text().as_uint();
  if (std::string_view(info.child_value("channel_format")) !=
      (stream.integers ? "int64" : "double64")) {
    return wrong("has a channel format that this version does not support");
  }
  if (layout.channels == 0 || layout.channels > kMaxSessionChannels) {
    return wrong("has no channels, or too many");
  }
  layout.places.fill(StreamLayout::kMissing);
  std::size_t place = 0;
  const bool samples = stream.id == SessionStream::Id::kSamples && !named.states;
  for (const pugi::xml_node& channel : info.child("desc").child("channels").children("channel")) {
    if (place == layout.channels) return wrong("describes more channels than the stream has");
    const std::string_view label = channel.child_value("label");
    bool known = false;
    for (std::size_t i = 0; i < stream.channels.size(); ++i) {
      if (stream.channels[i].label != label) continue;
      layout.places[i] = static_cast<std::uint8_t>(place);
      known = true;
    }
    if (samples && !known) {
      const auto found = std::find(extra_columns.begin(), extra_columns.end(), label);
      const auto column = static_cast<std::size_t>(found - extra_columns.begin());
      if (column < ProbeColumns::kMaxFurther) {
        layout.extra.push_back(
            {static_cast<std::uint8_t>(place), static_cast<std::uint8_t>(column)});
        if (found == extra_columns.end()) extra_columns.emplace_back(label);
      }
    }
    ++place;
  }
  for (std::size_t i = 0; i < stream.channels.size() && !stream.open_ended; ++i) {
    const SessionStream::Channel& each = stream.channels[i];
    // A channel that follows is in one stream or the other.
    if (layout.has(i) || each.later || (!named.states && !is_free(each, 0)) ||
        (named.states && is_free(each, 0))) {
      continue;
    }
    return wrong("lacks the channel " + std::string(each.label));
  }
  return layout;
}

}  // namespace merkel
