#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/raw_bytes.hpp"
#include "drivers/sessions/session_headers.hpp"
#include "drivers/sessions/session_records.hpp"
#include "drivers/sinks/afferent_table.hpp"
#include "drivers/sinks/file_sink.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

constexpr int kFlushesPerBoundary = 50;
constexpr int kFlushesPerClockOffset = 25;
/// A fixed mark of the format, from which a reader can resume in a damaged file.
constexpr unsigned char kBoundary[] = {0x43, 0xA5, 0x46, 0xDC, 0xCB, 0xF5, 0x41, 0x0F,
                                       0xB3, 0x0E, 0xD5, 0x46, 0x73, 0x83, 0xCB, 0xE4};

/// Writes a session: the input of the loop, its output and the facts of the run. SessionReader
/// reads it; `session_items` converts the items.
class SessionWriter final : public FileSink {
 public:
  SessionWriter(std::string uri, OutputFile file, const SinkSetup& setup)
      : FileSink(std::move(uri), std::move(file)),
        run_(setup.run),
        afferents_(afferent_csv(afferents_of(setup))),
        extra_(run_.probes) {}

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override { return kSessionKinds; }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (auto started = begin({}); !started) return started;
    bool written = true;
    for_each_kind(batch, [&]<class Record>(std::span<const Record> records) {
      if constexpr (kStored<Record>) written = written && write_items(records);
    });
    written = written && write_marks(batch.marks);
    return settle(written, batch.spikes.size());
  }

  [[nodiscard]] Expected<void, SinkError> flush() override {
    if (!started()) return {};
    const bool boundary_due = ++flushes_ % kFlushesPerBoundary == 0;
    if (flushes_ % kFlushesPerClockOffset == 1 && !write_clock_offsets()) return settle(false);
    if (boundary_due && !write_chunk(XdfTag::kBoundary, {reinterpret_cast<const char*>(kBoundary),
                                                         sizeof kBoundary})) {
      return settle(false);
    }
    return settle(file().flush());
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto started = begin({}); !started) return started;
    if (!write_clock_offsets()) return settle(false);
    for (const SessionStream& stream : streams()) {
      if (!write_footer(static_cast<std::uint32_t>(stream.id), tally(stream.id))) {
        return settle(false);
      }
    }
    if (!write_footer(kMarkStreamId, mark_tally_)) return settle(false);
    return settle(file().close());
  }

 private:
  [[nodiscard]] Expected<void, SinkError> start(const RunOrigin& origin) override {
    return settle(write_headers(run_, origin));
  }

  /// Those of taxels, the last, only for scenes with a tactile array.
  [[nodiscard]] std::span<const SessionStream> streams() const {
    const auto all = session_streams();
    static_assert(kSessionStreams == static_cast<std::size_t>(Id::kTaxels));
    return run_.model.has_arrays() ? all : all.first(all.size() - 1);
  }

  StreamTally& tally(Id id) { return tallies_[static_cast<std::size_t>(id) - 1]; }

  bool write_headers(const RunDescription& run, const RunOrigin& origin) {
    if (!file().write("XDF:") ||
        !write_chunk(XdfTag::kFileHeader, session_header(run, origin, afferents_))) {
      return false;
    }
    for (const SessionStream& stream : streams()) {
      if (!write_chunk_of(XdfTag::kStreamHeader, static_cast<std::uint32_t>(stream.id),
                          stream_header(stream, rate_Hz(stream.id, run), extra_))) {
        return false;
      }
    }
    if (!write_chunk_of(XdfTag::kStreamHeader, kMarkStreamId, mark_header())) return false;
    file().end_header();
    return file().flush();
  }

  bool write_footer(std::uint32_t id, StreamTally tally) {
    // A stream without samples must not set the file's start to the clock's origin.
    const double start_s = units::s_from(start_.value_or(nanoseconds{0}));
    if (tally.samples == 0) tally.first_s = tally.last_s = start_s;
    return write_chunk_of(XdfTag::kStreamFooter, id, stream_footer(tally));
  }

  /// Writes a chunk of one stream.
  bool write_chunk_of(XdfTag tag, std::uint32_t id, std::string_view content) {
    std::string chunk;
    append_raw(chunk, id);
    return write_chunk(tag, chunk.append(content));
  }

  bool write_chunk(XdfTag tag, std::string_view content) {
    std::string head;
    append_raw(head, std::uint8_t{4});
    append_raw(head, static_cast<std::uint32_t>(content.size() + sizeof tag));
    append_raw(head, tag);
    return file().write(head) && file().write(content);
  }

  /// Ticks have a regular rate; with several probes they share times and have none.
  static double rate_Hz(Id id, const RunDescription& run) {
    if (id != Id::kTicks || run.model.indenters.size() != 1) return 0.0;
    return 1.0 / units::s_from(run.model.tick);
  }

  /// Writes a chunk of items with 8-byte channels.
  template <class Item>
  bool write_items(std::span<const Item> items) {
    if (items.empty()) return true;
    constexpr Id kId = SessionStreamOf<Item>::kId;
    begin_chunk(static_cast<std::uint32_t>(kId), items.size());
    for (const Item& item : items) {
      if constexpr (std::is_same_v<Item, RunStatus>) {
        put(kId, newest(), item);
      } else {
        put(kId, time_of(item), item);
      }
      if constexpr (std::is_same_v<Item, DeliveredSample>) {
        for (std::size_t column = 0; column < extra_.size(); ++column) {
          append_raw(chunk_, extra_.value(item.probe, column, item.sample));
        }
      }
    }
    return write_chunk(XdfTag::kSamples, chunk_);
  }

  /// Written as a stream of strings, where XDF readers look for markers.
  bool write_marks(std::span<const Mark> marks) {
    if (marks.empty()) return true;
    begin_chunk(kMarkStreamId, marks.size());
    for (const Mark& mark : marks) {
      const double stamp_s = units::s_from(mark.time);
      append_raw(chunk_, std::uint8_t{8});
      append_raw(chunk_, stamp_s);
      append_raw(chunk_, std::uint8_t{4});
      append_raw(chunk_, static_cast<std::uint32_t>(mark.label.size()));
      chunk_ += mark.label;
      if (mark_tally_.samples++ == 0) mark_tally_.first_s = stamp_s;
      mark_tally_.last_s = stamp_s;
    }
    return write_chunk(XdfTag::kSamples, chunk_);
  }

  void begin_chunk(std::uint32_t id, std::size_t count) {
    chunk_.clear();
    append_raw(chunk_, id);
    append_raw(chunk_, std::uint8_t{4});
    append_raw(chunk_, static_cast<std::uint32_t>(count));
  }

  /// Appends an item of a stream with 8-byte channels.
  template <class Item>
  void put(Id id, nanoseconds time, const Item& item) {
    const double stamp_s = units::s_from(time);
    StreamTally& all = tally(id);
    if (all.samples++ == 0) all.first_s = stamp_s;
    all.last_s = stamp_s;
    if (!start_) start_ = newest_ = time;
    newest_ = std::max(newest_, time);
    append_raw(chunk_, std::uint8_t{8});
    append_raw(chunk_, stamp_s);
    ValuesOf<Item> values{};
    values_of(item, values);
    const std::size_t channels =
        session_streams()[static_cast<std::size_t>(id) - 1].channels.size();
    chunk_.append(reinterpret_cast<const char*>(values.data()), channels * sizeof values[0]);
  }

  /// The newest time in the file, in probe time; in an empty file, the host's time.
  [[nodiscard]] nanoseconds newest() const {
    return start_ ? newest_ : read_clock_pair().monotonic;
  }

  /// All streams share one clock, so every offset is 0. Some readers complain if these chunks are
  /// missing.
  bool write_clock_offsets() {
    for (const SessionStream& stream : streams()) {
      if (!write_clock_offset(static_cast<std::uint32_t>(stream.id))) return false;
    }
    return write_clock_offset(kMarkStreamId);
  }

  bool write_clock_offset(std::uint32_t id) {
    std::string content;
    append_raw(content, units::s_from(newest()));
    append_raw(content, 0.0);
    return write_chunk_of(XdfTag::kClockOffset, id, content);
  }

  RunDescription run_;
  std::string afferents_;
  ExtraColumns extra_;
  std::string chunk_;
  std::array<StreamTally, kSessionStreams> tallies_{};
  std::optional<nanoseconds> start_;  ///< of the first item
  nanoseconds newest_{0};             ///< of all items
  StreamTally mark_tally_;
  int flushes_ = 0;
};

}  // namespace

OpenedSink open_xdf_sink(const Uri& uri, const SinkSetup& setup) {
  if (auto done = UriOptions(uri).finish(); !done) return Unexpected<SetupError>(done.error());
  auto file = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!file) return Unexpected<SetupError>(file.error());
  return std::make_unique<SessionWriter>(uri.text, std::move(*file), setup);
}

}  // namespace merkel
