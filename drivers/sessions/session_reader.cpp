#include "drivers/sessions/session_reader.hpp"

#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>

#include <pugixml.hpp>
#include <sys/stat.h>

#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

/// No chunk of a session is longer; a longer one is skipped where the file holds it.
constexpr std::uint64_t kLongestChunk = std::uint64_t{16} << 20U;
constexpr std::size_t kMostChannels = 16;
constexpr double kLargestTime_s = 9.2e9;

/// Takes plain values off the front of some bytes; says false once they are used up.
class Bytes {
 public:
  explicit Bytes(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  [[nodiscard]] bool take(T& value) {
    if (rest_.size() < sizeof(T)) return false;
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return true;
  }
  /// A count whose width is told by the byte before it.
  [[nodiscard]] bool take_count(std::uint64_t& count) {
    std::uint8_t width = 0;
    if (!take(width)) return false;
    if (width == 1) return take_as<std::uint8_t>(count);
    if (width == 4) return take_as<std::uint32_t>(count);
    return width == 8 && take(count);
  }
  [[nodiscard]] std::size_t left() const { return rest_.size(); }

 private:
  template <class Narrow>
  bool take_as(std::uint64_t& count) {
    Narrow narrow{};
    if (!take(narrow)) return false;
    count = narrow;
    return true;
  }
  std::string_view rest_;
};

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
  std::uint64_t* const fields[] = {
      &status.ticks,           &status.overruns,      &status.longest_overrun_ns,
      &status.catch_up_ticks,  &status.gaps,          &status.skipped_ticks,
      &status.spikes,          &status.neuron_resets, &status.samples,
      &status.samples_dropped, &status.losses.spikes, &status.losses.ticks,
      &status.losses.events,   &status.losses.samples};
  for (std::size_t i = 0; i < std::size(fields); ++i) {
    if (!to_whole(values[i], INT64_MAX, *fields[i])) return false;
  }
  return true;
}

/// Decodes the samples of one chunk, each `channels` values of 8 bytes after its stamp.
template <class Values, class Item>
bool take_items(Bytes& bytes, std::uint64_t count, std::size_t channels, std::vector<Item>& items,
                bool (*to_item)(const Values&, Item&)) {
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

/// The stream that an XDF stream header describes, if it is one of merkel's; an error sentence
/// where it is, but not as it should be.
std::string check_stream(std::uint32_t id, const pugi::xml_node& info) {
  const std::string_view name = info.child_value("name");
  for (const SessionStream& stream : session_streams()) {
    const bool same_id = static_cast<std::uint32_t>(stream.id) == id;
    if (!same_id && stream.name != name) continue;
    if (!same_id || stream.name != name ||
        info.child("channel_count").text().as_uint() != stream.channels.size() ||
        std::string_view(info.child_value("channel_format")) !=
            (stream.integers ? "int64" : "double64")) {
      return "its stream " + std::to_string(id) + " is not that of a session of this version";
    }
  }
  return {};
}

}  // namespace

Expected<SessionReader, SetupError> SessionReader::open(const std::string& path) {
  std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "rb"));
  struct stat status {};
  if (!file || ::fstat(::fileno(file.get()), &status) != 0) {
    return bad_input("cannot read the session " + path + ": " + std::strerror(errno));
  }
  if (!S_ISREG(status.st_mode)) return bad_input(path + " is not a file: name a session (.xdf)");
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
    if (!read_bytes(&width, 1)) return damaged("it cannot be read on");
    if (width != 1 && width != 4 && width != 8) return damaged("a chunk has no valid length");
    std::uint16_t tag = 0;
    if (!read_bytes(&length, width) || length > size_ - place_) {
      truncated_ = true;  // the writer was stopped within this chunk
      return false;
    }
    if (length < sizeof tag || !read_bytes(&tag, sizeof tag)) {
      return damaged("a chunk is too short");
    }
    const std::uint64_t rest = length - sizeof tag;
    if (length > kLongestChunk) {
      if (::fseeko(file_.get(), static_cast<off_t>(rest), SEEK_CUR) != 0) {
        return damaged("it cannot be read on");
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

Expected<void, SetupError> SessionReader::read_headers() {
  std::array<char, 4> magic{};
  if (!read_bytes(magic.data(), magic.size()) || std::string_view(magic.data(), 4) != "XDF:") {
    return bad_input(path_ + " is not a session: an XDF file starts with \"XDF:\"");
  }
  std::size_t streams = 0;
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
      Bytes bytes(raw_.content);
      if (!bytes.take(id) || !document.load_buffer(raw_.content.data() + sizeof id, bytes.left())) {
        return damaged("a stream's header is not XML");
      }
      const std::string wrong = check_stream(id, document.child("info"));
      if (!wrong.empty()) return damaged(wrong);
      ++streams;
    } else {
      raw_pending_ = true;
    }
  }
  if (facts_.empty() || streams < session_streams().size()) {
    return bad_input(path_ + (truncated_ || raw_pending_ == false
                                  ? " broke off before its metadata: nothing can be read from it"
                                  : " is an XDF file, but was not recorded by merkel"));
  }
  return {};
}

Expected<void, SetupError> SessionReader::decode(std::string_view content,
                                                 SessionChunk& chunk) const {
  Bytes bytes(content);
  std::uint32_t id = 0;
  std::uint64_t count = 0;
  if (!bytes.take(id)) return damaged("a chunk of samples is too short");
  if (id == 0 || id > session_streams().size()) return {};  // somebody else's stream
  if (!bytes.take_count(count)) return damaged("a chunk of samples has no count");
  const SessionStream& stream = session_streams()[id - 1];
  chunk.stream = stream.id;
  const std::size_t channels = stream.channels.size();
  bool good = false;
  switch (stream.id) {
    case Id::kSpikes:
      good = take_items<Integers>(bytes, count, channels, chunk.spikes, to_spike);
      break;
    case Id::kTicks:
      good = take_items<Doubles>(bytes, count, channels, chunk.ticks, to_tick);
      break;
    case Id::kSamples:
      good = take_items<Doubles>(bytes, count, channels, chunk.samples, to_sample);
      break;
    case Id::kEvents:
      good = take_items<Integers>(bytes, count, channels, chunk.events, to_event);
      break;
    case Id::kStatus:
      good = take_items<Integers>(bytes, count, channels, chunk.status, to_status);
      break;
  }
  if (!good || bytes.left() != 0) {
    return damaged("a sample of " + std::string(stream.name) + " cannot be");
  }
  return {};
}

Expected<bool, SetupError> SessionReader::next(SessionChunk& chunk) {
  chunk.spikes.clear();
  chunk.ticks.clear();
  chunk.samples.clear();
  chunk.events.clear();
  chunk.status.clear();
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
    if (!chunk.spikes.empty() || !chunk.ticks.empty() || !chunk.samples.empty() ||
        !chunk.events.empty() || !chunk.status.empty()) {
      return true;
    }
  }
}

}  // namespace merkel
