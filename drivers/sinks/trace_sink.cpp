#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/protocols/trace_file.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {
namespace {

/// Writes the samples of the run's probe as a trace. A replay of the trace produces the same
/// spikes.
class TraceSink final : public Sink {
 public:
  /// \param run  in which the samples were recorded, if known
  TraceSink(std::string uri, TraceWriter trace, TimeBase time,
            const std::optional<RecordedRun>& run, std::size_t taxels)
      : uri_(std::move(uri)),
        trace_(std::move(trace)),
        time_(time),
        run_(run),
        pressures_kPa_(taxels) {}

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SpikeEvent, DeliveredSample, TaxelBlock>;
  }

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    if (std::exchange(header_written_, true)) return {};
    time_.set(origin);
    std::vector<std::string> comment;
    if (!time_.plain()) {
      for (const auto& [name, value] : time_.facts()) comment.push_back(name + "=" + value);
    } else if (run_) {
      comment.push_back("time_offset_ns=0");
      comment.push_back("start_device_ns=" + std::to_string(run_->start.count()));
    }
    return result_of(trace_.write_header(comment));
  }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (auto started = begin({}); !started) return started;
    // The trace determines the spikes, so none is written and none is lost.
    delivered_ += batch.spikes.size();
    shifted_.clear();
    rows_.clear();
    auto block = batch.taxels.begin();
    for (const DeliveredSample& item : batch.samples) {
      shifted_.push_back(item.sample);
      shifted_.back().time = time_(item.sample.time);
      ++written_;
      rows_.insert(rows_.end(), item.further.begin(), item.further.end());
      for (; block != batch.taxels.end() && block->tick <= written_; ++block) {
        if (block->first + std::size_t{block->count} > pressures_kPa_.size()) continue;
        std::copy_n(block->pressure_kPa.begin(), block->count,
                    pressures_kPa_.begin() + block->first);
      }
      rows_.insert(rows_.end(), pressures_kPa_.begin(), pressures_kPa_.end());
    }
    return result_of(trace_.write(shifted_, rows_));
  }

  [[nodiscard]] Expected<void, SinkError> flush() override { return result_of(trace_.flush()); }
  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto started = begin({}); !started) return started;
    return result_of(trace_.close());
  }
  void give_up() noexcept override { trace_.give_up(); }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  static Expected<void, SinkError> result_of(const Expected<void, SetupError>& result) {
    if (result) return {};
    return Unexpected<SinkError>({.sentence = result.error().sentence});
  }

  std::string uri_;
  TraceWriter trace_;
  TimeBase time_;
  std::optional<RecordedRun> run_;
  bool header_written_ = false;
  std::vector<ProbeSample> shifted_;
  std::uint64_t delivered_ = 0;
  std::uint64_t written_ = 0;         ///< samples
  std::vector<float> pressures_kPa_;  ///< of the taxels of an array, in the last sample
  std::vector<double> rows_;          ///< further columns and pressures
};

}  // namespace

OpenedSink open_trace_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (setup.run.probes.size() > 1) {
    return bad_input("\"" + uri.text +
                     "\": a trace holds one probe, but this scene has several: record a session "
                     "(xdf:FILE) instead");
  }
  std::size_t taxels = 0;
  for (const auto& [name, value] : setup.run.facts) {
    if (name != kTaxelFact) continue;
    std::from_chars(value.data() + value.find(':') + 1, value.data() + value.size(), taxels);
  }
  if (taxels > 0 && setup.neurons > 0) {
    return bad_input("\"" + uri.text +
                     "\": a run uses the pressures of a tactile array tick by tick, which a trace "
                     "does not hold: record a session (xdf:FILE) instead, or its samples without a "
                     "simulation by merkel record");
  }
  const std::uint32_t channels =
      setup.run.probes.empty() ? ProbeSample::kDepth : setup.run.probes.front().channels;
  std::vector<std::string> comment;
  for (const auto& [name, value] : setup.run.facts) {
    if (name == "command") comment.push_back(value);
  }
  const std::vector<std::string> extra = setup.run.probes.empty()
                                             ? std::vector<std::string>()
                                             : setup.run.probes.front().extra_columns;
  auto trace = TraceWriter::create(uri.path, channels, comment, setup.overwrite, setup.notice,
                                   extra, taxels);
  if (!trace) return Unexpected<SetupError>(trace.error());
  return std::make_unique<TraceSink>(
      uri.text, std::move(*trace), time,
      setup.run.probes.empty() ? std::nullopt : setup.run.probes.front().run, taxels);
}

}  // namespace merkel
