#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/files/csv_text.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/protocols/trace_file.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "drivers/sinks/text_sink.hpp"

namespace merkel {
namespace {

/// The samples of the run's probe as a trace, which TraceReader reads back bit-identical. A replay
/// of the trace produces the same spikes.
class TraceRows {
 public:
  TraceRows(const ProbeInfo& probe, std::size_t taxels)
      : channels_(probe.channels),
        run_(probe.run),
        further_(probe.extra_columns),
        pressures_kPa_(taxels) {}

  void append_head(std::string& head, const TimeBase& time) const {
    if (!time.plain()) {
      for (const auto& [name, value] : time.facts()) head += "# " + name + "=" + value + "\n";
    } else if (run_) {
      head += "# time_offset_ns=0\n# start_device_ns=" + std::to_string(run_->start.count()) + "\n";
    }
    head += "time_s";
    for (const SampleChannel& channel : kProbeChannels) {
      if (channel.in(channels_)) head.append(",").append(channel.column);
    }
    // A session may hold any text.
    for (const std::string& name : further_) head += "," + printable_column(name);
    for (std::size_t i = 1; i <= pressures_kPa_.size(); ++i) {
      head += ",taxel" + std::to_string(i) + "_kPa";
    }
    head += "\n";
  }

  std::size_t append(std::string& rows, const RecordBatch& batch, const TimeBase& time) {
    auto block = batch.taxels.begin();
    for (const DeliveredSample& item : batch.samples) {
      ++written_;
      for (; block != batch.taxels.end() && block->tick <= written_; ++block) {
        if (block->first + std::size_t{block->count} > pressures_kPa_.size()) continue;
        std::copy_n(block->pressure_kPa.begin(), block->count,
                    pressures_kPa_.begin() + block->first);
      }
      append_row(rows, item, time);
    }
    // The trace determines the spikes, so none is written and none is lost.
    return batch.spikes.size();
  }

 private:
  void append_row(std::string& rows, const DeliveredSample& item, const TimeBase& time) {
    if (item.sample.valid_for != valid_for_) {
      valid_for_ = item.sample.valid_for;
      rows += kValidityComment;
      append_seconds(rows, valid_for_);
      rows += '\n';
    }
    const bool zeroed = item.sample.zero_mN != 0.0 || item.sample.touch == Touch::kZeroed;
    if (zeroed && !std::exchange(zeroed_, true)) rows.append(kZeroComment).append("\n");
    append_seconds(rows, time(item.sample.time));
    for (const SampleChannel& channel : kProbeChannels) {
      if (!channel.in(channels_)) continue;
      rows += "," + shifted_decimal(item.sample.*channel.member, channel.power);
    }
    for (std::size_t i = 0; i < further_.size(); ++i) {
      rows += ',';
      if (i >= item.further.size() || std::isnan(item.further[i])) continue;
      rows += shifted_decimal(item.further[i], 0);
    }
    for (const float kPa : pressures_kPa_) rows += "," + pressure_text(kPa);
    rows += '\n';
  }

  std::uint32_t channels_;
  std::optional<RecordedRun> run_;    ///< in which the samples were recorded, if known
  std::vector<std::string> further_;  ///< names of columns
  std::vector<float> pressures_kPa_;  ///< of the taxels of an array, in the last sample
  std::chrono::nanoseconds valid_for_ = SampleSource::kNotStated;
  bool zeroed_ = false;
  std::uint64_t written_ = 0;  ///< samples
};

}  // namespace

OpenedSink open_trace_sink(const Uri& uri, const SinkSetup& setup) {
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
  std::string head;
  for (const auto& [name, value] : setup.run.facts) {
    if (name == "command") head += "# " + value + "\n";
  }
  const auto trace = std::make_shared<TraceRows>(setup.run.probes.empty()
                                                     ? ProbeInfo{.channels = ProbeSample::kDepth}
                                                     : setup.run.probes.front(),
                                                 taxels);
  return open_text_sink(
      uri, setup,
      {.head = std::move(head),
       .kinds = kKinds<SpikeEvent, DeliveredSample, TaxelBlock>,
       .append = [trace](std::string& rows, const RecordBatch& batch,
                         const TimeBase& time) { return trace->append(rows, batch, time); },
       .append_head = [trace](std::string& text,
                              const TimeBase& time) { trace->append_head(text, time); }});
}

}  // namespace merkel
