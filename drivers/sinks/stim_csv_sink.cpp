#include <string>
#include <utility>

#include "drivers/files/output_file.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/sinks/time_file.hpp"

namespace merkel {
namespace {

/// Writes stimulation commands as rows of CSV.
class StimCsvSink final : public SpikeSink {
 public:
  StimCsvSink(std::string uri, OutputFile file, TimeFile time_file,
              const EncodingParameters& encoding, TimeBase time)
      : uri_(std::move(uri)),
        file_(std::move(file)),
        time_file_(std::move(time_file)),
        text_(encoding),
        time_(time) {}

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<StimulationCommand>;
  }
  [[nodiscard]] bool stimulates() const noexcept override { return true; }

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    if (std::exchange(header_written_, true)) return {};
    time_.set(origin);
    if (!time_file_.write(time_)) return Unexpected<SinkError>({.sentence = time_file_.error()});
    const bool written = file_.write(StimulationText::csv_header() + "\n");
    file_.end_header();
    return settle(written);
  }
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (auto ready = begin({}); !ready || batch.commands.empty()) return ready;
    rows_.clear();
    for (StimulationCommand command : batch.commands) {
      command.time = time_(command.time);
      text_.append_row(rows_, command);
    }
    return settle(file_.write(rows_) && file_.flush());
  }
  [[nodiscard]] Expected<void, SinkError> flush() override { return settle(file_.flush()); }
  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto ready = begin({}); !ready) return ready;
    return settle(file_.close());
  }
  void give_up() noexcept override { file_.give_up(); }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return 0; }

 private:
  Expected<void, SinkError> settle(bool succeeded) {
    if (!succeeded) return Unexpected<SinkError>({.sentence = file_.error()});
    return {};
  }

  std::string uri_;
  OutputFile file_;
  TimeFile time_file_;
  StimulationText text_;
  TimeBase time_;
  bool header_written_ = false;
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
