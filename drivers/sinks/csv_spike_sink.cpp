#include "drivers/sinks/csv_spike_sink.hpp"

#include <array>
#include <charconv>
#include <utility>

#include "drivers/files/csv_text.hpp"

namespace merkel {

CsvSpikeSink::CsvSpikeSink(std::string uri, OutputFile file, NeuronNumbering numbering)
    : uri_(std::move(uri)), file_(std::move(file)), numbering_(std::move(numbering)) {}

Expected<std::unique_ptr<SpikeSink>, SetupError> CsvSpikeSink::open(const std::string& uri,
                                                                    const std::string& path,
                                                                    NeuronNumbering numbering,
                                                                    bool overwrite) {
  auto file = OutputFile::create(path, overwrite);
  if (!file) return Unexpected<SetupError>(file.error());
  if (!file->write("time_s,neuron\n")) return unavailable(file->error());
  return std::unique_ptr<SpikeSink>(new CsvSpikeSink(uri, std::move(*file), std::move(numbering)));
}

Expected<void, SinkError> CsvSpikeSink::settle(bool succeeded) {
  if (!succeeded) return Unexpected<SinkError>({.sentence = file_.error()});
  if (file_.settled()) delivered_ = taken_;
  return {};
}

Expected<void, SinkError> CsvSpikeSink::write(std::span<const SpikeEvent> spikes) {
  rows_.clear();
  for (const SpikeEvent& spike : spikes) {
    append_seconds(rows_, spike.time);
    std::array<char, 16> digits{};
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), numbering_.number(spike)).ptr;
    rows_ += ',';
    rows_.append(digits.data(), end);
    rows_ += '\n';
  }
  taken_ += spikes.size();
  return settle(file_.write(rows_));
}

Expected<void, SinkError> CsvSpikeSink::flush() { return settle(file_.flush()); }

Expected<void, SinkError> CsvSpikeSink::close() { return settle(file_.close()); }

}  // namespace merkel
