#include "drivers/sinks/text_sink.hpp"

#include <utility>

#include "drivers/files/csv_text.hpp"

namespace merkel {

TextSink::TextSink(std::string uri, OutputFile file, TimeFile time_file, TimeBase time, Form form)
    : FileSink(std::move(uri), std::move(file)),
      time_file_(std::move(time_file)),
      time_(time),
      form_(std::move(form)) {}

OpenedSink TextSink::open(const Uri& uri, const SinkSetup& setup, Form form) {
  UriOptions options(uri);
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  auto file = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!file) return Unexpected<SetupError>(file.error());
  auto time_file = TimeFile::beside(*file, setup);
  if (!time_file) return Unexpected<SetupError>(time_file.error());
  return std::unique_ptr<Sink>(
      new TextSink(uri.text, std::move(*file), std::move(*time_file), time, std::move(form)));
}

Expected<void, SinkError> TextSink::start(const RunOrigin& origin) {
  time_.set(origin);
  if (!time_file_.write(time_)) return Unexpected<SinkError>({.sentence = time_file_.error()});
  const bool written = file().write(form_.head);
  file().end_header();
  return settle(written);
}

Expected<void, SinkError> TextSink::write(const RecordBatch& batch) {
  if (auto started = begin({}); !started) return started;
  lines_.clear();
  const std::size_t spikes = form_.append(lines_, batch, time_);
  if (lines_.empty()) return {};
  return settle(file().write(lines_) && (!form_.at_once || file().flush()), spikes);
}

OpenedSink open_csv_sink(const Uri& uri, const SinkSetup& setup) {
  const auto append = [](std::string& lines, const RecordBatch& batch, const TimeBase& time) {
    for (const SpikeEvent& spike : batch.spikes) {
      append_seconds(lines, time(spike.time));
      lines.append(",").append(std::to_string(spike.neuron)).append("\n");
    }
    return batch.spikes.size();
  };
  return TextSink::open(
      uri, setup,
      {.head = "time_s,neuron\n", .kinds = kKinds<SpikeEvent>, .at_once = false, .append = append});
}

OpenedSink open_gdf_sink(const Uri& uri, const SinkSetup& setup) {
  const auto append = [](std::string& lines, const RecordBatch& batch, const TimeBase& time) {
    for (const SpikeEvent& spike : batch.spikes) {
      lines.append(std::to_string(spike.neuron)).append("\t");
      append_milliseconds(lines, time(spike.time));
      lines.append("\n");
    }
    return batch.spikes.size();
  };
  // Without a comment: readers differ in what they make of one. Neo, for one, takes the times of a
  // GDF file for whole numbers if its first line has no ".".
  return TextSink::open(
      uri, setup, {.head = "", .kinds = kKinds<SpikeEvent>, .at_once = false, .append = append});
}

}  // namespace merkel
