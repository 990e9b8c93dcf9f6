#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

#include <pugixml.hpp>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sessions/session_items.hpp"
#include "drivers/sinks/afferent_table.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little, "XDF is little-endian");

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

constexpr int kFlushesPerBoundary = 50;
constexpr int kFlushesPerClockOffset = 25;
/// A fixed mark of the format, from which a reader can resume in a damaged file.
constexpr unsigned char kBoundary[] = {0x43, 0xA5, 0x46, 0xDC, 0xCB, 0xF5, 0x41, 0x0F,
                                       0xB3, 0x0E, 0xD5, 0x46, 0x73, 0x83, 0xCB, 0xE4};

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

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

/// The columns of recorded samples that the model does not use, of all probes: one of a name.
struct ExtraColumns {
  explicit ExtraColumns(const std::vector<ProbeInfo>& probes) {
    for (const ProbeInfo& probe : probes) {
      columns_of.push_back(probe.extra_columns);
      for (const std::string& name : probe.extra_columns) {
        if (names.size() < ProbeSample::kMostExtra &&
            std::find(names.begin(), names.end(), name) == names.end()) {
          names.push_back(name);
        }
      }
    }
  }
  /// As it stands in the file, where the channels of every session have their own labels.
  [[nodiscard]] std::string label(std::size_t column) const {
    const auto& own = session_streams()[static_cast<std::size_t>(Id::kSamples) - 1].channels;
    const bool taken = std::any_of(own.begin(), own.end(), [&](const auto& channel) {
      return channel.label == names[column];
    });
    return (taken ? "column_" : "") + names[column];
  }
  /// NaN where the probe does not have the column.
  [[nodiscard]] double value(std::size_t probe, std::size_t column,
                             const ProbeSample& sample) const {
    if (probe < columns_of.size()) {
      const auto& own = columns_of[probe];
      const auto found = std::find(own.begin(), own.end(), names[column]);
      if (found != own.end()) return sample.extra[static_cast<std::size_t>(found - own.begin())];
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  std::vector<std::string> names;
  std::vector<std::vector<std::string>> columns_of;  ///< by probe
};

/// Writes a session: what the loop used, what it made, and the run's facts. Its reader is
/// `SessionReader`; the values of an item are in `session_items`.
class SessionWriter final : public SpikeSink {
 public:
  SessionWriter(std::string uri, OutputFile file, const SinkSetup& setup)
      : uri_(std::move(uri)),
        file_(std::move(file)),
        run_(setup.run),
        afferents_(afferent_csv(afferents_of(setup))),
        extra_(run_.probes) {}

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    if (std::exchange(started_, true)) return {};
    return settle(write_headers(run_, origin));
  }

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kTicks | kEvents | kSamples | kStatus | kFrames | kMarks | kStimulation;
  }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    if (auto started = begin_items(Id::kSpikes, spikes.size()); !started) return started;
    for (const SpikeEvent& spike : spikes) put<std::int64_t>(Id::kSpikes, spike.time, spike);
    taken_ += spikes.size();
    return write_items();
  }

  [[nodiscard]] Expected<void, SinkError> write_ticks(std::span<const TickRecord> ticks) override {
    if (auto started = begin_items(Id::kTicks, ticks.size()); !started) return started;
    for (const TickRecord& tick : ticks) put<double>(Id::kTicks, tick.time, tick);
    return write_items();
  }

  [[nodiscard]] Expected<void, SinkError> write_events(std::span<const LoopEvent> events) override {
    if (auto started = begin_items(Id::kEvents, events.size()); !started) return started;
    for (const LoopEvent& event : events) put<std::int64_t>(Id::kEvents, event.time, event);
    return write_items();
  }

  [[nodiscard]] Expected<void, SinkError> write_samples(
      std::size_t probe, std::span<const ProbeSample> samples) override {
    if (auto started = begin_items(Id::kSamples, samples.size()); !started) return started;
    for (const ProbeSample& sample : samples) {
      put<double>(Id::kSamples, sample.time,
                  SessionChunk::Sample{static_cast<std::uint32_t>(probe), sample});
      for (std::size_t column = 0; column < extra_.names.size(); ++column) {
        append(chunk_, extra_.value(probe, column, sample));
      }
    }
    return write_items();
  }

  [[nodiscard]] Expected<void, SinkError> write_frames(std::size_t probe, std::size_t port,
                                                       std::span<const RawFrame> frames) override {
    if (auto started = begin_items(Id::kFrames, frames.size()); !started) return started;
    for (const RawFrame& frame : frames) {
      put<std::int64_t>(Id::kFrames, frame.time,
                        SessionChunk::Frame{static_cast<std::uint32_t>(probe),
                                            static_cast<std::uint32_t>(port), frame});
    }
    return write_items();
  }

  /// Written as a stream of strings, where XDF readers look for markers.
  [[nodiscard]] Expected<void, SinkError> write_marks(std::span<const Mark> marks) override {
    if (auto started = begin({}); !started) return started;
    chunk_.clear();
    append(chunk_, kMarkStreamId);
    append(chunk_, std::uint8_t{4});
    append(chunk_, static_cast<std::uint32_t>(marks.size()));
    for (const Mark& mark : marks) {
      const double stamp_s = units::s_from(mark.time);
      append(chunk_, std::uint8_t{8});
      append(chunk_, stamp_s);
      append(chunk_, std::uint8_t{4});
      append(chunk_, static_cast<std::uint32_t>(mark.label.size()));
      chunk_ += mark.label;
      if (mark_tally_.samples++ == 0) mark_tally_.first_s = stamp_s;
      mark_tally_.last_s = stamp_s;
    }
    return settle(write_chunk(XdfTag::kSamples, chunk_));
  }

  [[nodiscard]] Expected<void, SinkError> write_commands(
      std::span<const StimulationCommand> commands) override {
    if (auto begun = begin_items(Id::kStimulation, commands.size()); !begun) return begun;
    for (const StimulationCommand& command : commands) {
      put<double>(Id::kStimulation, command.time, command);
    }
    return write_items();
  }

  [[nodiscard]] Expected<void, SinkError> write_status(const RunStatus& status) override {
    if (auto started = begin_items(Id::kStatus, 1); !started) return started;
    put<std::int64_t>(Id::kStatus, newest(), status);
    return write_items();
  }

  [[nodiscard]] Expected<void, SinkError> flush() override {
    if (!started_) return {};
    const bool boundary_due = ++flushes_ % kFlushesPerBoundary == 0;
    if (flushes_ % kFlushesPerClockOffset == 1 && !write_clock_offsets()) return settle(false);
    if (boundary_due && !write_chunk(XdfTag::kBoundary, {reinterpret_cast<const char*>(kBoundary),
                                                         sizeof kBoundary})) {
      return settle(false);
    }
    return settle(file_.flush());
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto started = begin({}); !started) return started;
    if (!write_clock_offsets()) return settle(false);
    for (const SessionStream& stream : session_streams()) {
      if (!write_footer(static_cast<std::uint32_t>(stream.id), tally(stream.id))) {
        return settle(false);
      }
    }
    if (!write_footer(kMarkStreamId, mark_tally_)) return settle(false);
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

  bool write_headers(const RunDescription& run, const RunOrigin& origin) {
    if (!file_.write("XDF:")) return false;
    pugi::xml_document document;
    pugi::xml_node info = document.append_child("info");
    add(info, "version", "1.0");
    pugi::xml_node facts = info.append_child("merkel");
    for (const auto& [name, value] : run.facts) add(facts, name.c_str(), value);
    add(facts, "scene", run.scene);
    const auto add_missing = [&](const char* name, const std::string& value) {
      if (!value.empty() && !facts.child(name)) add(facts, name, value);
    };
    add_missing("afferents", afferents_);
    // An export keeps the clocks of the recording.
    add_missing("start_device_ns", std::to_string(origin.start.count()));
    if (origin.utc.count() != 0) add_missing("start_utc_ns", std::to_string(origin.utc.count()));
    if (!facts.child("clock_monotonic_ns")) {
      const ClockPair clocks = read_clock_pair();
      add(facts, "clock_monotonic_ns", std::to_string(clocks.monotonic.count()));
      add(facts, "clock_utc_ns", std::to_string(clocks.utc.count()));
    }
    if (!write_chunk(XdfTag::kFileHeader, xml_of(document))) return false;
    for (const SessionStream& stream : session_streams()) {
      if (!write_stream_header(stream, rate_Hz(stream.id, run))) return false;
    }
    if (!write_mark_header()) return false;
    file_.end_header();
    return file_.flush();
  }

  bool write_chunk(XdfTag tag, std::string_view content) {
    std::string head;
    append(head, std::uint8_t{4});
    append(head, static_cast<std::uint32_t>(content.size() + sizeof tag));
    append(head, tag);
    return file_.write(head) && file_.write(content);
  }

  /// Ticks have a regular rate; with several probes they share times and have none.
  static double rate_Hz(Id id, const RunDescription& run) {
    if (id != Id::kTicks || run.model.indenters.size() != 1) return 0.0;
    return 1.0 / units::s_from(run.model.tick);
  }

  bool write_stream_header(const SessionStream& stream, double rate_Hz) {
    pugi::xml_document document;
    pugi::xml_node info = document.append_child("info");
    add(info, "name", stream.name);
    add(info, "type", stream.type);
    const bool samples = stream.id == Id::kSamples;
    add(info, "channel_count",
        std::to_string(stream.channels.size() + (samples ? extra_.names.size() : 0)));
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
    for (std::size_t i = 0; samples && i < extra_.names.size(); ++i) {
      pugi::xml_node channel = channels.append_child("channel");
      add(channel, "label", extra_.label(i));
      add(channel, "meaning", "a column of the recording, not used by the model");
    }
    std::string content;
    append(content, stream.id);
    return write_chunk(XdfTag::kStreamHeader, content + xml_of(document));
  }

  bool write_mark_header() {
    pugi::xml_document document;
    pugi::xml_node info = document.append_child("info");
    add(info, "name", kMarkStreamName);
    add(info, "type", "Markers");
    add(info, "channel_count", "1");
    add(info, "nominal_srate", "0");
    add(info, "channel_format", "string");
    add(info, "source_id", kMarkStreamName);
    std::string content;
    append(content, kMarkStreamId);
    return write_chunk(XdfTag::kStreamHeader, content + xml_of(document));
  }

  bool write_footer(std::uint32_t id, Tally all) {
    // A stream without samples must not set the file's start to the clock's origin.
    const double start_s = units::s_from(start_.value_or(nanoseconds{0}));
    if (all.samples == 0) all.first_s = all.last_s = start_s;
    pugi::xml_document document;
    pugi::xml_node info = document.append_child("info");
    info.append_child("first_timestamp").text().set(all.first_s);
    info.append_child("last_timestamp").text().set(all.last_s);
    add(info, "sample_count", std::to_string(all.samples));
    std::string content;
    append(content, id);
    return write_chunk(XdfTag::kStreamFooter, content + xml_of(document));
  }

  /// Starts a chunk of `count` items.
  Expected<void, SinkError> begin_items(Id id, std::size_t count) {
    if (auto started = begin({}); !started) return started;
    chunk_.clear();
    append(chunk_, id);
    append(chunk_, std::uint8_t{4});
    append(chunk_, static_cast<std::uint32_t>(count));
    return {};
  }

  /// Appends an item of a stream with 8-byte channels.
  template <class Value, class Item>
  void put(Id id, nanoseconds time, const Item& item) {
    const double stamp_s = units::s_from(time);
    Tally& all = tally(id);
    if (all.samples++ == 0) all.first_s = stamp_s;
    all.last_s = stamp_s;
    if (!start_) start_ = newest_ = time;
    newest_ = std::max(newest_, time);
    append(chunk_, std::uint8_t{8});
    append(chunk_, stamp_s);
    ItemValues<Value> values{};
    values_of(item, values);
    const std::size_t channels =
        session_streams()[static_cast<std::size_t>(id) - 1].channels.size();
    chunk_.append(reinterpret_cast<const char*>(values.data()), channels * sizeof(Value));
  }

  Expected<void, SinkError> write_items() { return settle(write_chunk(XdfTag::kSamples, chunk_)); }

  /// The newest time in the file, in probe time; in an empty file, the host's time.
  [[nodiscard]] nanoseconds newest() const {
    return start_ ? newest_ : read_clock_pair().monotonic;
  }

  /// All streams share one clock, so every offset is 0. Some readers complain if these chunks are
  /// missing.
  bool write_clock_offsets() {
    for (const SessionStream& stream : session_streams()) {
      if (!write_clock_offset(static_cast<std::uint32_t>(stream.id))) return false;
    }
    return write_clock_offset(kMarkStreamId);
  }

  bool write_clock_offset(std::uint32_t id) {
    std::string content;
    append(content, id);
    append(content, units::s_from(newest()));
    append(content, 0.0);
    return write_chunk(XdfTag::kClockOffset, content);
  }

  Expected<void, SinkError> settle(bool succeeded) {
    if (!succeeded) return Unexpected<SinkError>({.sentence = file_.error()});
    if (file_.settled()) delivered_ = taken_;
    return {};
  }

  std::string uri_;
  OutputFile file_;
  RunDescription run_;
  std::string afferents_;
  ExtraColumns extra_;
  bool started_ = false;
  std::string chunk_;
  std::array<Tally, kSessionStreams> tallies_{};
  std::optional<nanoseconds> start_;  ///< of the first item
  nanoseconds newest_{0};             ///< of all items
  Tally mark_tally_;
  int flushes_ = 0;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace

OpenedSink open_xdf_sink(const Uri& uri, const SinkSetup& setup) {
  if (auto done = UriOptions(uri).finish(); !done) return Unexpected<SetupError>(done.error());
  auto file = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!file) return Unexpected<SetupError>(file.error());
  return std::make_unique<SessionWriter>(uri.text, std::move(*file), setup);
}

}  // namespace merkel
