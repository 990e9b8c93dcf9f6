#include <string>
#include <utility>

#include "drivers/sinks/file_sink.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/sinks/time_file.hpp"

namespace merkel {
namespace {

/// Writes stimulation commands as rows of CSV.
class StimCsvSink final : public FileSink {
 public:
  StimCsvSink(std::string uri, OutputFile file, TimeFile time_file,
              const EncodingParameters& encoding, TimeBase time)
      : FileSink(std::move(uri), std::move(file)),
        time_file_(std::move(time_file)),
        text_(encoding),
        time_(time) {}

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SentCommand>;
  }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (auto ready = begin({}); !ready || batch.sent.empty()) return ready;
    rows_.clear();
    for (SentCommand sent : batch.sent) {
      sent.command.time = time_(sent.command.time);
      text_.append_row(rows_, sent);
    }
    return settle(file().write(rows_) && file().flush());
  }

 private:
  [[nodiscard]] Expected<void, SinkError> start(const RunOrigin& origin) override {
    time_.set(origin);
    if (!time_file_.write(time_)) return Unexpected<SinkError>({.sentence = time_file_.error()});
    const bool written = file().write(StimulationText::csv_header() + "\n");
    file().end_header();
    return settle(written);
  }

  TimeFile time_file_;
  StimulationText text_;
  TimeBase time_;
  std::string rows_;
};

}  // namespace

OpenedSink open_stim_csv_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (auto some = require_electrodes(uri, setup.run.encoding); !some) {
    return Unexpected<SetupError>(some.error());
  }
  auto file = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!file) return Unexpected<SetupError>(file.error());
  auto time_file = TimeFile::beside(*file, setup);
  if (!time_file) return Unexpected<SetupError>(time_file.error());
  return std::make_unique<StimCsvSink>(uri.text, std::move(*file), std::move(*time_file),
                                       setup.run.encoding, time);
}

}  // namespace merkel
