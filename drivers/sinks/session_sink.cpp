#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/units.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sessions/session_headers.hpp"
#include "drivers/sessions/session_records.hpp"
#include "drivers/sessions/xdf_chunks.hpp"
#include "drivers/sinks/file_sink.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

using Id = SessionStream::Id;
using std::chrono::nanoseconds;

constexpr int kFlushesPerBoundary = 50;
constexpr int kFlushesPerClockOffset = 25;
/// So many records wait at most, so that chunks are long.
constexpr std::size_t kMaxWaitingRecords = 1024;

/// The stream of a probe.
struct ProbeStream {
  const SessionStream* stream = nullptr;
  std::uint32_t probe = 0;
  ProbeInfo info = {};
  std::optional<ItemValues<double>> next = {};  ///< in the channels that follow

  [[nodiscard]] std::uint32_t number() const { return stream_number(*stream, probe); }
  /// True if the channels that the stream does not have are as expected, to the bit.
  [[nodiscard]] bool follows(const ItemValues<double>& values) const {
    if (!next) return false;
    for (std::size_t i = 0; i < stream->channels.size(); ++i) {
      if (!is_free(stream->channels[i], info.channels) &&
          std::bit_cast<std::uint64_t>(values[i]) != std::bit_cast<std::uint64_t>((*next)[i])) {
        return false;
      }
    }
    return true;
  }
};

const SessionStream& stream_with(Id id) {
  return session_streams()[static_cast<std::size_t>(id) - 1];
}

/// A probe without a description may measure anything.
ProbeInfo info_of(const RunDescription& run, std::size_t probe) {
  if (probe < run.probes.size()) return run.probes[probe];
  ProbeInfo unknown;
  unknown.channels = ~0U;
  return unknown;
}

/// Writes a session: the input of the loop, its output and the facts of the run. SessionReader
/// reads it; `session_items` converts the items. Records wait for the next flush.
class SessionWriter final : public FileSink {
 public:
  SessionWriter(std::string uri, OutputFile file, const SinkSetup& setup, bool frames)
      : FileSink(std::move(uri), std::move(file)),
        run_(setup.run),
        afferents_(afferents_of(setup)),
        journal_(setup.session_journal),
        source_(setup.journal),
        frames_(frames) {
    const std::size_t probes = std::clamp<std::size_t>(
        std::max(run_.probes.size(), run_.model.indenters.size()), 1, kMaxSessionProbes);
    for (const SessionStream& stream : session_streams()) {
      for (std::uint32_t probe = 0; stream.of_probe() && probe < probes; ++probe) {
        probe_streams_.push_back({&stream, probe, info_of(run_, probe)});
      }
    }
  }

  ~SessionWriter() override {
    if (journal_) journal_->fail("the session " + file().path() + " was not completed");
  }

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kSessionKinds & (frames_ ? ~0U : ~kKinds<PortFrame>);
  }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (auto started = begin({}); !started) return started;
    for_each_kind(batch, [this]<class Record>(std::span<const Record> records) {
      if ((subscriptions() & kKind<Record>) == 0U) return;
      auto& list = waiting_.of<Record>();
      list.insert(list.end(), records.begin(), records.end());
    });
    return count_of(waiting_) < kMaxWaitingRecords ? Expected<void, SinkError>() : write_waiting();
  }

  [[nodiscard]] Expected<void, SinkError> flush() override {
    if (!started()) return {};
    if (auto written = write_waiting(); !written) return written;
    const bool boundary_due = ++flushes_ % kFlushesPerBoundary == 0;
    if (flushes_ % kFlushesPerClockOffset == 1 &&
        !(write_clocks() && chunks_.write_clock_offsets())) {
      return settle(false);
    }
    if (boundary_due && !chunks_.write_boundary()) return settle(false);
    return settle(file().flush());
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto started = begin({}); !started) return started;
    if (auto written = write_waiting(); !written) return written;
    bool clocks = write_clocks();
    for (const ClockReading& each :
         source_ ? source_->clock_readings() : std::vector<ClockReading>()) {
      clocks = clocks && write_clocks({.monotonic = each.from, .utc = each.to});
    }
    if (!clocks || !chunks_.write_clock_offsets() || !chunks_.write_footers()) {
      return settle(false);
    }
    auto closed = settle(file().close());
    if (closed && journal_) journal_->complete(file().path());
    return closed;
  }

 private:
  [[nodiscard]] Expected<void, SinkError> start(const RunOrigin& origin) override {
    return settle(write_headers(run_, origin));
  }

  bool write_headers(const RunDescription& run, const RunOrigin& origin) {
    if (!file().write("XDF:") ||
        !chunks_.write(XdfTag::kFileHeader,
                       session_header(run, origin, afferent_csv(afferents_)))) {
      return false;
    }
    live_ = is_live(run, origin);
    // Those of the samples come first: they name the columns of a recording.
    if (!begin_streams(Id::kSamples)) return false;
    file().end_header();
    return file().flush();
  }

  /// Writes the headers of the streams of a kind, with its first samples: some readers take a
  /// stream without samples for damage.
  bool begin_streams(Id id) {
    if (std::exchange(begun_[static_cast<std::size_t>(id)], true)) return true;
    const SessionStream& stream = stream_with(id);
    if (!stream.of_probe()) {
      return chunks_.write_header(stream_number(stream, 0), stream_header(stream, afferents_));
    }
    return chunks_.write_header(states_number(stream), states_header(stream)) &&
           std::all_of(probe_streams_.begin(), probe_streams_.end(), [&](const ProbeStream& each) {
             return each.stream != &stream ||
                    chunks_.write_header(each.number(),
                                         probe_stream_header(stream, each.probe, each.info));
           });
  }

  /// Writes a reading of the clocks, with which sessions of several hosts are aligned.
  bool write_clocks() { return !live_ || write_clocks(read_clock_pair()); }
  bool write_clocks(const ClockPair& now) {
    if (!std::exchange(begun_[kClockStreamId], true) &&
        !chunks_.write_header(kClockStreamId, clock_header())) {
      return false;
    }
    chunks_.begin_sample(kClockStreamId, now.monotonic, true);
    chunks_.append(std::int64_t{now.monotonic.count()});
    chunks_.append(std::int64_t{now.utc.count()});
    return chunks_.end_samples(kClockStreamId);
  }

  /// Writes the records that wait. Ticks come last: a reader that has the ticks of a time has
  /// everything else of it.
  Expected<void, SinkError> write_waiting() {
    bool written = true;
    for_each_kind(waiting_, [&]<class Record>(const std::vector<Record>& records) {
      if constexpr (kStored<Record> && !std::is_same_v<Record, TickRecord>) {
        written = written && write_kind(records);
      }
    });
    written = written && write_marks(waiting_.marks) && write_kind(waiting_.ticks);
    const std::size_t spikes = waiting_.spikes.size();
    clear_all(waiting_);
    return settle(written, spikes);
  }

  template <class Record>
  bool write_kind(const std::vector<Record>& records) {
    if (records.empty()) return true;
    if (!begin_streams(SessionStreamOf<Record>::kId)) return false;
    if constexpr (kOfProbe<Record>) {
      return std::all_of(probe_streams_.begin(), probe_streams_.end(), [&](ProbeStream& each) {
        return each.stream->id != SessionStreamOf<Record>::kId || write_of_probe(each, records);
      });
    } else {
      return write_items(records);
    }
  }

  /// Writes the items of one probe. A chunk ends where a channel does not follow.
  template <class Item>
  bool write_of_probe(ProbeStream& to, const std::vector<Item>& items) {
    const std::uint32_t number = to.number();
    for (const Item& item : items) {
      if (item.probe != to.probe) continue;
      ItemValues<double> values{};
      values_of(item, values);
      if (!to.follows(values)) {
        if (!chunks_.end_samples(number)) return false;
        const std::uint32_t states = states_number(*to.stream);
        chunks_.begin_sample(states, time_of(item), true);
        append_values(*to.stream, values, [](const auto& each) { return !is_free(each, 0); });
        if (!chunks_.end_samples(states)) return false;
      }
      // Each has its stamp: readers bend the times of a stream of a nominal rate around gaps.
      chunks_.begin_sample(number, time_of(item), true);
      append_values(*to.stream, values,
                    [&](const auto& each) { return is_free(each, to.info.channels); });
      if constexpr (std::is_same_v<Item, DeliveredSample>) {
        for (std::size_t i = 0; i < to.info.extra_columns.size(); ++i) {
          chunks_.append(i < item.further.size() ? item.further[i]
                                                 : std::numeric_limits<double>::quiet_NaN());
        }
      }
      to.next = values;
      follow(*to.stream, run_.model.tick, *to.next);
    }
    return chunks_.end_samples(number);
  }

  template <class Choice>
  void append_values(const SessionStream& stream, const ItemValues<double>& values,
                     const Choice& has) {
    for (std::size_t i = 0; i < stream.channels.size(); ++i) {
      if (has(stream.channels[i])) chunks_.append(values[i]);
    }
  }

  /// Writes a chunk of items with 8-byte channels.
  template <class Item>
  bool write_items(const std::vector<Item>& items) {
    constexpr Id kId = SessionStreamOf<Item>::kId;
    const std::uint32_t number = stream_number(stream_with(kId), 0);
    for (const Item& item : items) {
      if constexpr (std::is_same_v<Item, RunStatus>) {
        chunks_.begin_sample(number, chunks_.newest(), true);
      } else {
        chunks_.begin_sample(number, time_of(item), true);
      }
      ValuesOf<Item> values{};
      values_of(item, values);
      const std::size_t channels = stream_with(kId).channels.size();
      for (std::size_t i = 0; i < channels; ++i) chunks_.append(values[i]);
    }
    return chunks_.end_samples(number);
  }

  /// Written as a stream of strings, where XDF readers look for markers.
  bool write_marks(const std::vector<Mark>& marks) {
    if (!marks.empty() && !std::exchange(begun_[kMarkStreamId], true) &&
        !chunks_.write_header(kMarkStreamId, mark_header())) {
      return false;
    }
    for (const Mark& mark : marks) {
      chunks_.begin_sample(kMarkStreamId, mark.time, true);
      chunks_.append_text(mark.label);
    }
    return chunks_.end_samples(kMarkStreamId);
  }

  /// Those that wait for this session learn of its error.
  [[nodiscard]] Expected<void, SinkError> settle(bool written, std::size_t spikes = 0) {
    auto settled = FileSink::settle(written, spikes);
    if (!settled && journal_) journal_->fail(settled.error().sentence);
    return settled;
  }

  RunDescription run_;
  std::vector<AfferentRow> afferents_;
  std::shared_ptr<SessionJournal> journal_;  ///< null: no sink waits for this session
  std::shared_ptr<RunJournal> source_;       ///< the recorded run that is copied; else null
  bool frames_;
  std::vector<ProbeStream> probe_streams_;
  RecordLists<RecordVector> waiting_;
  XdfChunks chunks_{file()};
  std::array<bool, kClockStreamId + 1> begun_{};  ///< by the number of a stream or kind
  int flushes_ = 0;
  bool live_ = false;  ///< in real time, on the host's clock
};

}  // namespace

OpenedSink open_xdf_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const bool frames = options.whole("frames", 0, 0, 1) == 1;
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  auto file = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!file) return Unexpected<SetupError>(file.error());
  return std::make_unique<SessionWriter>(uri.text, std::move(*file), setup, frames);
}

}  // namespace merkel
