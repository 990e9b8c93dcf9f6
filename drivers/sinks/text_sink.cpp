#include "drivers/sinks/text_sink.hpp"

#include <array>
#include <charconv>
#include <utility>

#include "drivers/files/csv_text.hpp"

namespace merkel {

namespace {

void append_number(std::string& text, std::uint32_t number) {
  std::array<char, 16> digits{};
  text.append(digits.data(),
              std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
}

}  // namespace

TextSink::TextSink(std::string uri, OutputFile file, TimeFile time_file, Form form, TimeBase time)
    : FileSink(std::move(uri), std::move(file)),
      time_file_(std::move(time_file)),
      form_(form),
      time_(time) {}

Expected<std::unique_ptr<Sink>, SetupError> TextSink::open(const Uri& uri, const std::string& path,
                                                           Form form, const SinkSetup& setup) {
  UriOptions options(uri);
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  auto file = OutputFile::create(path, setup.overwrite, setup.notice);
  if (!file) return Unexpected<SetupError>(file.error());
  auto time_file = TimeFile::beside(*file, setup);
  if (!time_file) return Unexpected<SetupError>(time_file.error());
  return std::unique_ptr<Sink>(
      new TextSink(uri.text, std::move(*file), std::move(*time_file), form, time));
}

Expected<void, SinkError> TextSink::start(const RunOrigin& origin) {
  time_.set(origin);
  if (!time_file_.write(time_)) return Unexpected<SinkError>({.sentence = time_file_.error()});
  // Neither form has comments: readers differ in what they make of them. Neo, for one, takes the
  // times of a GDF file for whole numbers if its first line has no ".".
  const bool written = form_ == Form::kGdf || file().write("time_s,neuron\n");
  file().end_header();
  return settle(written);
}

Expected<void, SinkError> TextSink::write(const RecordBatch& batch) {
  if (auto started = begin({}); !started) return started;
  rows_.clear();
  for (const SpikeEvent& spike : batch.spikes) {
    const std::uint32_t neuron = spike.neuron;
    if (form_ == Form::kCsv) {
      append_seconds(rows_, time_(spike.time));
      rows_ += ',';
      append_number(rows_, neuron);
    } else {
      append_number(rows_, neuron);
      rows_ += '\t';
      append_milliseconds(rows_, time_(spike.time));
    }
    rows_ += '\n';
  }
  return settle(file().write(rows_), batch.spikes.size());
}

}  // namespace merkel
