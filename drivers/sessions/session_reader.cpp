#include "drivers/sessions/session_reader.hpp"

#include <algorithm>
#include <chrono>
#include <tuple>

#include <pugixml.hpp>

#include "drivers/parsed_number.hpp"
#include "drivers/sessions/byte_span.hpp"
#include "drivers/sessions/session_items.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

nanoseconds time_fact(const SessionReader& session, std::string_view name) {
  return nanoseconds{parsed_number<std::int64_t>(session.fact(name)).value_or(0)};
}

/// The longest list of ticks that is put in order.
constexpr std::size_t kMaxTicksAtOnce = std::size_t{1} << 20U;

}  // namespace

Expected<SessionReader, SetupError> SessionReader::open(const std::string& path) {
  const auto [file_path, rig] = split_rig(path);
  auto file = XdfFile::open(file_path);
  if (!file) return Unexpected<SetupError>(file.error());
  SessionReader reader(path, std::move(*file));
  if (auto read = reader.read_headers(rig); !read) return Unexpected<SetupError>(read.error());
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

void SessionReader::read_only(std::initializer_list<SessionStream::Id> streams) {
  decoded_ = 0;
  for (const SessionStream::Id each : streams) decoded_ |= 1U << static_cast<std::uint32_t>(each);
}

Expected<void, SetupError> SessionReader::add_stream(std::uint32_t id, const pugi::xml_node& info) {
  const auto named = stream_named(info.child_value("name"));
  if (!named) return {};
  if (std::any_of(layouts_.begin(), layouts_.end(), [&](const auto& each) {
        return static_cast<const NamedStream&>(each.second) == *named;
      })) {
    return file_.damaged("two streams have the same name");
  }
  auto layout = layout_of(*named, info, extra_columns_);
  if (!layout) return file_.damaged(layout.error());
  using Id = SessionStream::Id;
  if (named->stream->id == Id::kSamples) {
    const auto channels = named->stream->channels;
    const auto validity = std::find_if(channels.begin(), channels.end(), [](const auto& each) {
      return each.label == "valid_for_ns";
    });
    has_validity_ =
        has_validity_ || layout->has(static_cast<std::size_t>(validity - channels.begin()));
  }
  if (named->stream->id == Id::kTicks && !named->states) ++tick_streams_;
  if (!layouts_.emplace(id, std::move(*layout)).second)
    return file_.damaged("two streams have the same number");
  return {};
}

std::span<FollowingItem> SessionReader::following(const SessionStream& stream) {
  auto& items = following_[stream.id];
  if (items.empty()) {
    items.resize(stream.of_probe() ? kMaxSessionProbes : 1);
    const nanoseconds tick = time_fact(*this, "tick_ns");
    for (FollowingItem& each : items) each.tick = tick;
  }
  return items;
}

/// The header of a stream, which comes at the latest with its first samples.
Expected<void, SetupError> SessionReader::read_stream_header() {
  std::uint32_t id = 0;
  ByteSpan bytes(raw_.content);
  pugi::xml_document document;
  if (!bytes.take(id) || !document.load_buffer(raw_.content.data() + sizeof id, bytes.left())) {
    return file_.damaged("a stream's header is not XML");
  }
  const pugi::xml_node info = document.child("info");
  if (auto added = add_stream(id, info); !added) return added;
  const std::string_view name = info.child_value("name");
  if (name == kMarkStreamName) mark_stream_ = id;
  if (name == kClockStreamName) clock_stream_ = id;
  const auto layout = layouts_.find(id);
  if (layout != layouts_.end()) layout->second.extra_columns = extra_columns_.size();
  return {};
}

Expected<void, SetupError> SessionReader::read_headers(std::string_view rig) {
  while (!raw_pending_) {
    const auto read = file_.next(raw_);
    if (!read) return Unexpected<SetupError>(read.error());
    if (!*read) break;
    pugi::xml_document document;
    if (raw_.tag == XdfTag::kFileHeader) {
      if (!document.load_buffer(raw_.content.data(), raw_.content.size())) {
        return file_.damaged("its metadata is not XML");
      }
      for (const pugi::xml_node& node : document.child("info").child("merkel")) {
        facts_.emplace_back(node.name(), node.child_value());
      }
    } else if (raw_.tag == XdfTag::kStreamHeader) {
      if (auto added = read_stream_header(); !added) return added;
    } else {
      raw_pending_ = true;
    }
  }
  // The other streams begin with their first samples.
  const bool samples = std::any_of(layouts_.begin(), layouts_.end(), [](const auto& each) {
    return each.second.stream->id == SessionStream::Id::kSamples && !each.second.states;
  });
  for (auto& [id, layout] : layouts_) layout.extra_columns = extra_columns_.size();
  if (facts_.empty() || !samples) {
    rig_ = std::make_unique<RigRecording>();
    const auto found = rig_->read(file_, rig);
    if (!found) return Unexpected<SetupError>(found.error());
    if (*found) {
      facts_ = rig_->facts();
      raw_pending_ = false;
      return {};
    }
    return bad_input(path_ + (file_.truncated() || raw_pending_ == false
                                  ? " ends before its metadata: it contains nothing readable"
                                  : " is an XDF file, but was not recorded by merkel"));
  }
  if (rig.empty()) return {};
  return bad_input(path_ + " is the session of one run: leave out @" + std::string(rig));
}

Expected<void, SetupError> SessionReader::decode(std::string_view content, SessionChunk& chunk) {
  std::uint32_t id = 0;
  if (!ByteSpan(content).take(id)) return file_.damaged("a chunk of samples is too short");
  const std::string_view rows = content.substr(sizeof id);
  if (rig_) {
    if (rig_->decode(id, rows, chunk)) return {};
    return file_.damaged("a sample of the rig has an invalid value");
  }
  if (id == mark_stream_) {
    if (decode_marks(rows, chunk)) return {};
    return file_.damaged("a mark cannot be read");
  }
  if (id == clock_stream_) {
    if (decode_clock_readings(rows, clock_readings_)) return {};
    return file_.damaged("a reading of the clocks cannot be read");
  }
  const auto found = layouts_.find(id);
  if (found == layouts_.end()) return {};  // a stream of another program
  const StreamLayout& layout = found->second;
  if ((decoded_ >> static_cast<std::uint32_t>(layout.stream->id) & 1U) == 0U) return {};
  const auto next = following(*layout.stream);
  const bool decoded = layout.states ? decode_states(layout, rows, next)
                                     : decode_items(layout, rows, next[layout.probe], chunk);
  if (decoded) return {};
  return file_.damaged("a sample of " +
                       (layout.states ? std::string(layout.stream->states)
                                      : stream_name(*layout.stream, layout.probe)) +
                       " has an invalid value");
}

/// True if raw_ has ticks of a probe, or what they follow.
bool SessionReader::is_of_ticks() const {
  std::uint32_t id = 0;
  if (raw_.tag != XdfTag::kSamples || !ByteSpan(raw_.content).take(id)) return false;
  const auto found = layouts_.find(id);
  return found != layouts_.end() && found->second.stream->id == SessionStream::Id::kTicks;
}

/// After a chunk of ticks, reads those of the other probes, and puts all of them in order.
Expected<void, SetupError> SessionReader::read_other_ticks(SessionChunk& chunk) {
  bool ended = false;
  while (chunk.ticks.size() < kMaxTicksAtOnce) {
    const auto read = file_.next(raw_);
    if (!read) return Unexpected<SetupError>(read.error());
    ended = !*read;
    if (ended) break;
    if (!is_of_ticks()) {
      raw_pending_ = true;
      break;
    }
    if (auto decoded = decode(raw_.content, chunk); !decoded) return decoded;
  }
  std::stable_sort(chunk.ticks.begin(), chunk.ticks.end(),
                   [](const TickRecord& a, const TickRecord& b) {
                     return std::tie(a.number, a.probe) < std::tie(b.number, b.probe);
                   });
  if (!ended) return {};
  // The file broke off, since it has no footers: ticks that lack a probe are not whole.
  const auto last = std::find_if(chunk.ticks.rbegin(), chunk.ticks.rend(),
                                 [&](const auto& tick) { return tick.probe + 1 == tick_streams_; });
  chunk.ticks.erase(last.base(), chunk.ticks.end());
  return {};
}

Expected<bool, SetupError> SessionReader::next(SessionChunk& chunk) {
  clear_all(chunk);
  for (;;) {
    if (!std::exchange(raw_pending_, false)) {
      const auto read = file_.next(raw_);
      if (!read || !*read) return read;
    }
    if (raw_.tag == XdfTag::kStreamFooter) ++footers_;
    if (raw_.tag == XdfTag::kStreamHeader && !rig_) {
      if (auto added = read_stream_header(); !added) return Unexpected<SetupError>(added.error());
    }
    if (raw_.tag != XdfTag::kSamples) continue;
    if (auto decoded = decode(raw_.content, chunk); !decoded) {
      return Unexpected<SetupError>(decoded.error());
    }
    if (!chunk.ticks.empty() && tick_streams_ > 1) {
      if (auto others = read_other_ticks(chunk); !others) {
        return Unexpected<SetupError>(others.error());
      }
    }
    if (count_of(chunk) > 0) return true;
  }
}

namespace {

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
  if (!session.fact("rig").empty()) return time_fact(session, "start_device_ns");
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
