#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <iterator>
#include <sstream>
#include <utility>

#include <pugixml.hpp>

#include "core/units.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sessions/session_format.hpp"
#include "drivers/sinks/clock_pair.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

constexpr int kFlushesPerBoundary = 50;
/// Marks places from which a damaged file can be read on; fixed by the format.
constexpr unsigned char kBoundary[] = {0x43, 0xA5, 0x46, 0xDC, 0xCB, 0xF5, 0x41, 0x0F,
                                       0xB3, 0x0E, 0xD5, 0x46, 0x73, 0x83, 0xCB, 0xE4};

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// XML 1.0 has no way to write most control characters, and wants UTF-8.
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

struct SplitTime {
  double whole_s;
  double rest_ns;
};

SplitTime split(nanoseconds time) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  return {.whole_s = static_cast<double>(whole.count()),
          .rest_ns = static_cast<double>((time - whole).count())};
}

std::int64_t whole(std::uint64_t value) { return static_cast<std::int64_t>(value); }

/// Records everything: what the loop used, what it made, and what it was.
class XdfSpikeSink final : public SpikeSink {
 public:
  XdfSpikeSink(std::string uri, OutputFile file) : uri_(std::move(uri)), file_(std::move(file)) {}

  bool write_headers(const RunDescription& run) {
    if (!file_.write("XDF:")) return false;
    pugi::xml_document document;
    pugi::xml_node info = document.append_child("info");
    add(info, "version", "1.0");
    pugi::xml_node facts = info.append_child("merkel");
    for (const auto& [name, value] : run.facts) add(facts, name.c_str(), value);
    add(facts, "scene", run.scene);
    // A copy keeps the clocks of the recording.
    if (!facts.child("clock_monotonic_ns")) {
      const ClockPair clocks = read_clock_pair();
      add(facts, "clock_monotonic_ns", std::to_string(clocks.monotonic.count()));
      add(facts, "clock_utc_ns", std::to_string(clocks.utc.count()));
    }
    if (!write_chunk(XdfTag::kFileHeader, xml_of(document))) return false;
    for (const SessionStream& stream : session_streams()) {
      if (!write_stream_header(stream)) return false;
    }
    file_.end_header();
    return file_.flush();
  }

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t wishes() const noexcept override {
    return kTicks | kEvents | kSamples | kStatus | kFrames;
  }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    begin(Id::kSpikes, spikes.size());
    for (const SpikeEvent& spike : spikes) {
      stamp(Id::kSpikes, spike.time);
      put<std::int64_t>({spike.time.count(), spike.neuron, spike.patch, spike.flags});
    }
    taken_ += spikes.size();
    return settle(write_chunk(XdfTag::kSamples, chunk_));
  }

  [[nodiscard]] Expected<void, SinkError> write_ticks(std::span<const TickRecord> ticks) override {
    begin(Id::kTicks, ticks.size());
    for (const TickRecord& tick : ticks) {
      stamp(Id::kTicks, tick.time);
      const SplitTime time = split(tick.time);
      put<double>({static_cast<double>(tick.number), static_cast<double>(tick.probe), time.whole_s,
                   time.rest_ns, static_cast<double>(tick.latency.count()), tick.contact.depth_mm,
                   tick.contact.force_mN, tick.contact.x_mm, tick.contact.y_mm,
                   static_cast<double>(tick.late), static_cast<double>(tick.state)});
    }
    return settle(write_chunk(XdfTag::kSamples, chunk_));
  }

  [[nodiscard]] Expected<void, SinkError> write_events(std::span<const LoopEvent> events) override {
    begin(Id::kEvents, events.size());
    for (const LoopEvent& event : events) {
      stamp(Id::kEvents, event.time);
      put<std::int64_t>({event.time.count(), event.length.count(), event.subject,
                         static_cast<std::int64_t>(event.kind)});
    }
    return settle(write_chunk(XdfTag::kSamples, chunk_));
  }

  [[nodiscard]] Expected<void, SinkError> write_samples(
      std::size_t probe, std::span<const ProbeSample> samples) override {
    begin(Id::kSamples, samples.size());
    for (const ProbeSample& sample : samples) {
      stamp(Id::kSamples, sample.time);
      const SplitTime time = split(sample.time);
      const SplitTime arrival = split(sample.arrival);
      put<double>({static_cast<double>(probe), time.whole_s, time.rest_ns, arrival.whole_s,
                   arrival.rest_ns, sample.depth_mm, sample.force_mN, sample.x_mm, sample.y_mm,
                   static_cast<double>(sample.sequence), static_cast<double>(sample.channels)});
    }
    return settle(write_chunk(XdfTag::kSamples, chunk_));
  }

  [[nodiscard]] Expected<void, SinkError> write_frames(std::size_t probe, std::size_t port,
                                                       std::span<const RawFrame> frames) override {
    begin(Id::kFrames, frames.size());
    for (const RawFrame& frame : frames) {
      stamp(Id::kFrames, frame.time);
      put<std::int64_t>({whole(probe), whole(port), frame.time.count(),
                         static_cast<std::int64_t>(frame.kind), frame.length, frame.parsed,
                         frame.damaged, frame.lost});
      append(chunk_, frame.bytes);
    }
    return settle(write_chunk(XdfTag::kSamples, chunk_));
  }

  [[nodiscard]] Expected<void, SinkError> write_status(const RunStatus& status) override {
    begin(Id::kStatus, 1);
    stamp(Id::kStatus, read_clock_pair().monotonic);
    put<std::int64_t>({whole(status.ticks),
                       whole(status.overruns),
                       whole(status.longest_overrun_ns),
                       whole(status.catch_up_ticks),
                       whole(status.gaps),
                       whole(status.skipped_ticks),
                       whole(status.spikes),
                       whole(status.neuron_resets),
                       whole(status.samples),
                       whole(status.samples_dropped),
                       whole(status.losses.spikes),
                       whole(status.losses.ticks),
                       whole(status.losses.events),
                       whole(status.losses.samples),
                       whole(status.losses.frames),
                       status.rights.scheduling_class,
                       status.rights.priority,
                       status.rights.cpu,
                       status.rights.locked_memory_kB,
                       status.rights.timer_slack_ns,
                       status.rights.cpu_awake});
    return settle(write_chunk(XdfTag::kSamples, chunk_));
  }

  [[nodiscard]] Expected<void, SinkError> flush() override {
    if (++flushes_ % kFlushesPerBoundary == 0 &&
        !write_chunk(XdfTag::kBoundary,
                     {reinterpret_cast<const char*>(kBoundary), sizeof kBoundary})) {
      return settle(false);
    }
    return settle(file_.flush());
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    for (const SessionStream& stream : session_streams()) {
      if (!write_footer(stream)) return settle(false);
    }
    return settle(file_.close());
  }

  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  struct Tally {
    std::uint64_t samples = 0;
    double first_s = 0.0;
    double last_s = 0.0;
  };

  Tally& tally(Id id) { return tallies_[static_cast<std::size_t>(id) - 1]; }

  bool write_chunk(XdfTag tag, std::string_view content) {
    std::string head;
    append(head, std::uint8_t{4});
    append(head, static_cast<std::uint32_t>(content.size() + sizeof tag));
    append(head, tag);
    return file_.write(head) && file_.write(content);
  }

  bool write_stream_header(const SessionStream& stream) {
    pugi::xml_document document;
    pugi::xml_node info = document.append_child("info");
    add(info, "name", stream.name);
    add(info, "type", stream.type);
    add(info, "channel_count", std::to_string(stream.channels.size()));
    add(info, "nominal_srate", "0");
    add(info, "channel_format", stream.integers ? "int64" : "double64");
    add(info, "source_id", stream.name);
    pugi::xml_node channels = info.append_child("desc").append_child("channels");
    for (const SessionStream::Channel& each : stream.channels) {
      pugi::xml_node channel = channels.append_child("channel");
      add(channel, "label", each.label);
      add(channel, "unit", each.unit);
    }
    std::string content;
    append(content, stream.id);
    return write_chunk(XdfTag::kStreamHeader, content + xml_of(document));
  }

  bool write_footer(const SessionStream& stream) {
    const Tally& all = tally(stream.id);
    pugi::xml_document document;
    pugi::xml_node info = document.append_child("info");
    info.append_child("first_timestamp").text().set(all.first_s);
    info.append_child("last_timestamp").text().set(all.last_s);
    add(info, "sample_count", std::to_string(all.samples));
    std::string content;
    append(content, stream.id);
    return write_chunk(XdfTag::kStreamFooter, content + xml_of(document));
  }

  void begin(Id id, std::size_t count) {
    chunk_.clear();
    append(chunk_, id);
    append(chunk_, std::uint8_t{4});
    append(chunk_, static_cast<std::uint32_t>(count));
  }

  void stamp(Id id, nanoseconds time) {
    const double stamp_s = units::s_from(time);
    Tally& all = tally(id);
    if (all.samples++ == 0) all.first_s = stamp_s;
    all.last_s = stamp_s;
    append(chunk_, std::uint8_t{8});
    append(chunk_, stamp_s);
  }

  template <class Value>
  void put(std::initializer_list<Value> values) {
    for (const Value value : values) append(chunk_, value);
  }

  Expected<void, SinkError> settle(bool succeeded) {
    if (!succeeded) return Unexpected<SinkError>({.sentence = file_.error()});
    if (file_.settled()) delivered_ = taken_;
    return {};
  }

  std::string uri_;
  OutputFile file_;
  std::string chunk_;
  std::array<Tally, 6> tallies_;
  int flushes_ = 0;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace

OpenedSink open_xdf_sink(const Uri& uri, const SinkSetup& setup) {
  if (auto done = UriOptions(uri).finish(); !done) return Unexpected<SetupError>(done.error());
  auto file = OutputFile::create(uri.path, setup.overwrite);
  if (!file) return Unexpected<SetupError>(file.error());
  auto sink = std::make_unique<XdfSpikeSink>(uri.text, std::move(*file));
  if (!sink->write_headers(setup.run)) {
    return unavailable("cannot write " + uri.path + ": is the disk full?");
  }
  return sink;
}

}  // namespace merkel
