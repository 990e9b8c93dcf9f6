#include "drivers/sinks/text_spike_sink.hpp"

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

TextSpikeSink::TextSpikeSink(std::string uri, OutputFile file, Form form)
    : uri_(std::move(uri)), file_(std::move(file)), form_(form) {}

Expected<std::unique_ptr<SpikeSink>, SetupError> TextSpikeSink::open(const std::string& uri,
                                                                     const std::string& path,
                                                                     Form form, bool overwrite) {
  auto file = OutputFile::create(path, overwrite);
  if (!file) return Unexpected<SetupError>(file.error());
  if (form == Form::kCsv && !file->write("time_s,neuron\n")) return unavailable(file->error());
  file->end_header();
  return std::unique_ptr<SpikeSink>(new TextSpikeSink(uri, std::move(*file), form));
}

Expected<void, SinkError> TextSpikeSink::settle(bool succeeded) {
  if (!succeeded) return Unexpected<SinkError>({.sentence = file_.error()});
  if (file_.settled()) delivered_ = taken_;
  return {};
}

Expected<void, SinkError> TextSpikeSink::write(std::span<const SpikeEvent> spikes) {
  rows_.clear();
  for (const SpikeEvent& spike : spikes) {
    const std::uint32_t neuron = spike.neuron;
    if (form_ == Form::kCsv) {
      append_seconds(rows_, spike.time);
      rows_ += ',';
      append_number(rows_, neuron);
    } else {
      append_number(rows_, neuron);
      rows_ += '\t';
      append_milliseconds(rows_, spike.time);
    }
    rows_ += '\n';
  }
  taken_ += spikes.size();
  return settle(file_.write(rows_));
}

Expected<void, SinkError> TextSpikeSink::flush() { return settle(file_.flush()); }

Expected<void, SinkError> TextSpikeSink::close() { return settle(file_.close()); }

}  // namespace merkel
