#include "drivers/sessions/session_reader.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>

#include <pugixml.hpp>
#include <sys/stat.h>

#include "drivers/sessions/byte_span.hpp"
#include "drivers/sessions/session_items.hpp"

namespace merkel {
namespace {

/// The longest chunk of a session; longer ones are skipped.
constexpr std::uint64_t kLongestChunk = std::uint64_t{16} << 20U;

/// The layout of one of merkel's streams in the file, or an error.
Expected<StreamLayout, std::string> layout_of(const SessionStream& stream,
                                              const pugi::xml_node& info,
                                              std::vector<std::string>& extra_columns) {
  const auto wrong = [&](const std::string& what) {
    return Unexpected<std::string>("its stream " + std::string(stream.name) + " " + what);
  };
  StreamLayout layout{
      .stream = &stream, .channels = info.child("channel_count").text().as_uint(), .places = {}};
  if (std::string_view(info.child_value("channel_format")) !=
      (stream.integers ? "int64" : "double64")) {
    return wrong("has a channel format that this version does not support");
  }
  if (layout.channels == 0 || layout.channels > kMostSessionChannels) {
    return wrong("has no channels, or too many");
  }
  layout.places.fill(StreamLayout::kMissing);
  std::size_t place = 0;
  const bool samples = stream.id == SessionStream::Id::kSamples;
  for (const pugi::xml_node& channel : info.child("desc").child("channels").children("channel")) {
    if (place == layout.channels) return wrong("describes more channels than the stream has");
    const std::string_view label = channel.child_value("label");
    bool known = false;
    for (std::size_t i = 0; i < stream.channels.size(); ++i) {
      if (stream.channels[i].label != label) continue;
      layout.places[i] = static_cast<std::uint8_t>(place);
      known = true;
    }
    if (samples && !known && layout.extra.size() < ProbeSample::kMostExtra) {
      layout.extra.push_back(static_cast<std::uint8_t>(place));
      extra_columns.emplace_back(label);
    }
    ++place;
  }
  for (std::size_t i = 0; i < stream.channels.size() && !stream.open_ended; ++i) {
    if (layout.places[i] != StreamLayout::kMissing || stream.channels[i].later) continue;
    return wrong("lacks the channel " + std::string(stream.channels[i].label));
  }
  return layout;
}

}  // namespace

Expected<SessionReader, SetupError> SessionReader::open(const std::string& path) {
  std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "rb"));
  struct stat status {};
  if (!file || ::fstat(::fileno(file.get()), &status) != 0) {
    return bad_input("cannot read the session " + path + ": " + std::strerror(errno));
  }
  if (!S_ISREG(status.st_mode)) return bad_input(path + " is not a file: use a session (.xdf)");
  SessionReader reader(path, std::move(file), static_cast<std::uint64_t>(status.st_size));
  if (auto read = reader.read_headers(); !read) return Unexpected<SetupError>(read.error());
  return reader;
}

std::string SessionReader::fact(std::string_view name) const {
  for (const auto& [key, value] : facts_) {
    if (key == name) return value;
  }
  return {};
}

std::vector<std::string> SessionReader::facts(std::string_view name) const {
  std::vector<std::string> all;
  for (const auto& [key, value] : facts_) {
    if (key == name) all.push_back(value);
  }
  return all;
}

bool SessionReader::read_bytes(void* bytes, std::size_t count) {
  if (std::fread(bytes, 1, count, file_.get()) != count) return false;
  place_ += count;
  return true;
}

Unexpected<SetupError> SessionReader::damaged(const std::string& what) const {
  return bad_input("the session " + path_ + " is damaged at byte " + std::to_string(chunk_start_) +
                   ": " + what);
}

Expected<bool, SetupError> SessionReader::read_raw(Raw& raw) {
  for (;;) {
    chunk_start_ = place_;
    if (truncated_ || place_ == size_) return false;
    std::uint8_t width = 0;
    std::uint64_t length = 0;
    if (!read_bytes(&width, 1)) return damaged("the file is unreadable");
    if (width != 1 && width != 4 && width != 8) return damaged("a chunk has an invalid length");
    std::uint16_t tag = 0;
    if (!read_bytes(&length, width) || length > size_ - place_) {
      truncated_ = true;  // the writer stopped within this chunk
      return false;
    }
    if (length < sizeof tag || !read_bytes(&tag, sizeof tag)) {
      return damaged("a chunk is too short");
    }
    const std::uint64_t rest = length - sizeof tag;
    if (length > kLongestChunk) {
      if (::fseeko(file_.get(), static_cast<off_t>(rest), SEEK_CUR) != 0) {
        return damaged("the file is unreadable");
      }
      place_ += rest;
      continue;
    }
    raw.tag = static_cast<XdfTag>(tag);
    raw.content.resize(rest);
    if (!read_bytes(raw.content.data(), rest)) {
      truncated_ = true;
      return false;
    }
    return true;
  }
}

Expected<void, SetupError> SessionReader::add_stream(std::uint32_t id, const pugi::xml_node& info) {
  const std::string_view name = info.child_value("name");
  for (const SessionStream& stream : session_streams()) {
    if (stream.name != name) continue;
    if (std::any_of(layouts_.begin(), layouts_.end(),
                    [&](const auto& layout) { return layout.second.stream == &stream; })) {
      return damaged("two streams have the same name");
    }
    auto layout = layout_of(stream, info, extra_columns_);
    if (!layout) return damaged(layout.error());
    if (stream.id == SessionStream::Id::kSamples) {
      has_validity_ = layout->places[stream.channels.size() - 1] != StreamLayout::kMissing;
    }
    if (!layouts_.emplace(id, *layout).second) return damaged("two streams have the same number");
  }
  return {};
}

Expected<void, SetupError> SessionReader::read_headers() {
  std::array<char, 4> magic{};
  if (!read_bytes(magic.data(), magic.size()) || std::string_view(magic.data(), 4) != "XDF:") {
    return bad_input(
        path_ +
        " is not a session recorded by the sink xdf: (it does not start with \"XDF:\"); a "
        "trace is played by merkel run --fast --probe replay:FILE");
  }
  while (!raw_pending_) {
    const auto read = read_raw(raw_);
    if (!read) return Unexpected<SetupError>(read.error());
    if (!*read) break;
    pugi::xml_document document;
    if (raw_.tag == XdfTag::kFileHeader) {
      if (!document.load_buffer(raw_.content.data(), raw_.content.size())) {
        return damaged("its metadata is not XML");
      }
      for (const pugi::xml_node& node : document.child("info").child("merkel")) {
        facts_.emplace_back(node.name(), node.child_value());
      }
    } else if (raw_.tag == XdfTag::kStreamHeader) {
      std::uint32_t id = 0;
      ByteSpan bytes(raw_.content);
      if (!bytes.take(id) || !document.load_buffer(raw_.content.data() + sizeof id, bytes.left())) {
        return damaged("a stream's header is not XML");
      }
      if (auto added = add_stream(id, document.child("info")); !added) return added;
      if (document.child("info").child_value("name") == kMarkStreamName) mark_stream_ = id;
    } else {
      raw_pending_ = true;
    }
  }
  // Sessions of older versions have no stimulation commands, and those without a tactile array no
  // pressures of taxels.
  const auto complete = [this](const SessionStream& stream) {
    return stream.id == SessionStream::Id::kStimulation ||
           stream.id == SessionStream::Id::kTaxels ||
           std::any_of(layouts_.begin(), layouts_.end(),
                       [&](const auto& layout) { return layout.second.stream == &stream; });
  };
  if (facts_.empty() ||
      !std::all_of(session_streams().begin(), session_streams().end(), complete)) {
    return bad_input(path_ + (truncated_ || raw_pending_ == false
                                  ? " ends before its metadata: it contains nothing readable"
                                  : " is an XDF file, but was not recorded by merkel"));
  }
  return {};
}

Expected<void, SetupError> SessionReader::decode(std::string_view content,
                                                 SessionChunk& chunk) const {
  std::uint32_t id = 0;
  if (!ByteSpan(content).take(id)) return damaged("a chunk of samples is too short");
  if (id == mark_stream_) {
    if (decode_marks(content.substr(sizeof id), chunk)) return {};
    return damaged("a mark cannot be read");
  }
  const auto layout = layouts_.find(id);
  if (layout == layouts_.end()) return {};  // a stream of another program
  if (!decode_items(layout->second, content.substr(sizeof id), chunk)) {
    return damaged("a sample of " + std::string(layout->second.stream->name) +
                   " has an invalid value");
  }
  return {};
}

Expected<bool, SetupError> SessionReader::next(SessionChunk& chunk) {
  clear_all(chunk);
  for (;;) {
    if (!std::exchange(raw_pending_, false)) {
      const auto read = read_raw(raw_);
      if (!read || !*read) return read;
    }
    if (raw_.tag == XdfTag::kStreamFooter) ++footers_;
    if (raw_.tag != XdfTag::kSamples) continue;
    if (auto decoded = decode(raw_.content, chunk); !decoded) {
      return Unexpected<SetupError>(decoded.error());
    }
    if (count_of(chunk) > 0) return true;
  }
}

namespace {

std::chrono::nanoseconds time_fact(const SessionReader& session, std::string_view name) {
  const std::string text = session.fact(name);
  std::int64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return std::chrono::nanoseconds{value};
}

/// The time of the first tick or sample of a session.
Expected<std::chrono::nanoseconds, SetupError> first_time(SessionReader& session) {
  SessionChunk chunk;
  for (;;) {
    const auto more = session.next(chunk);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) return std::chrono::nanoseconds{0};
    if (!chunk.ticks.empty()) return chunk.ticks.front().time - time_fact(session, "tick_ns");
    if (!chunk.samples.empty() && session.fact("tick_ns").empty()) {
      return chunk.samples.front().sample.time;
    }
  }
}

}  // namespace

Expected<std::chrono::nanoseconds, SetupError> session_start(const SessionReader& session) {
  auto again = SessionReader::open(session.path());
  if (!again) return Unexpected<SetupError>(again.error());
  return first_time(*again);
}

Expected<RunOrigin, SetupError> session_origin(const SessionReader& session) {
  RunOrigin origin{.start = time_fact(session, "start_device_ns"),
                   .utc = time_fact(session, "start_utc_ns")};
  if (!session.fact("start_device_ns").empty()) return origin;
  const auto start = session_start(session);
  if (!start) return Unexpected<SetupError>(start.error());
  origin.start = *start;
  origin.utc =
      time_fact(session, "clock_utc_ns") + (*start - time_fact(session, "clock_monotonic_ns"));
  return origin;
}

}  // namespace merkel
