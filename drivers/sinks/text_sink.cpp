#include "drivers/sinks/text_sink.hpp"

#include <optional>
#include <utility>

#include <unistd.h>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/file_rename.hpp"
#include "drivers/sinks/file_sink.hpp"

namespace merkel {
namespace {

std::string time_name(const std::string& path) { return path + ".time"; }

/// Opens NAME.time, unless the head has the conversion, or NAME is a device or a pipe. Fails if it
/// exists, unless `overwrite`. The one of a killed run keeps its name beside the recovered file.
Expected<std::optional<OutputFile>, SetupError> open_time_file(const OutputFile& file,
                                                               const TextForm& form,
                                                               const SinkSetup& setup) {
  if (form.append_head || file.part().empty()) return std::nullopt;
  const std::string name = time_name(file.path());
  if (!file.recovered().empty()) {
    static_cast<void>(rename_without_replacing(name, time_name(file.recovered())));
  }
  // A failed run may have completed this file, but not the one it belongs to.
  if (::access(file.path().c_str(), F_OK) != 0) set_aside(name);
  auto made = OutputFile::create(name, setup.overwrite, setup.notice);
  if (!made) return Unexpected<SetupError>(made.error());
  return std::move(*made);
}

class TextSink final : public FileSink {
 public:
  TextSink(std::string uri, OutputFile file, std::optional<OutputFile> time_file, bool overwrite,
           TimeBase time, TextForm form)
      : FileSink(std::move(uri), std::move(file)),
        time_file_(std::move(time_file)),
        overwrite_(overwrite),
        time_(time),
        form_(std::move(form)) {}

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override { return form_.kinds; }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (auto started = begin({}); !started) return started;
    lines_.clear();
    const std::size_t spikes = form_.append(lines_, batch, time_);
    if (lines_.empty() && spikes == 0) return {};
    return settle(file().write(lines_) && (!form_.at_once || file().flush()), spikes);
  }

 private:
  [[nodiscard]] Expected<void, SinkError> start(const RunOrigin& origin) override {
    time_.set(origin);
    if (!write_time_file()) return Unexpected<SinkError>({.sentence = time_file_->error()});
    if (form_.append_head) form_.append_head(form_.head, time_);
    const bool written = file().write(form_.head);
    file().end_header();
    return settle(written);
  }

  /// Completes the file, or removes it if it is not needed.
  bool write_time_file() {
    if (!time_file_) return true;
    if (time_.plain()) {
      time_file_->remove();
      if (overwrite_) ::unlink(time_file_->path().c_str());  // of the run whose files are replaced
      return true;
    }
    std::string text;
    for (const auto& [name, value] : time_.facts()) text += name + " = " + value + "\n";
    return time_file_->write(text) && time_file_->close();
  }

  std::optional<OutputFile> time_file_;
  bool overwrite_;
  TimeBase time_;
  TextForm form_;
  std::string lines_;
};

}  // namespace

OpenedSink open_text_sink(const Uri& uri, const SinkSetup& setup, TextForm form) {
  UriOptions options(uri);
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  auto file = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!file) return Unexpected<SetupError>(file.error());
  auto time_file = open_time_file(*file, form, setup);
  if (!time_file) return Unexpected<SetupError>(time_file.error());
  return std::make_unique<TextSink>(uri.text, std::move(*file), std::move(*time_file),
                                    setup.overwrite, time, std::move(form));
}

OpenedSink open_csv_sink(const Uri& uri, const SinkSetup& setup) {
  const auto append = [](std::string& lines, const RecordBatch& batch, const TimeBase& time) {
    for (const SpikeEvent& spike : batch.spikes) {
      append_seconds(lines, time(spike.time));
      lines.append(",").append(std::to_string(spike.neuron)).append("\n");
    }
    return batch.spikes.size();
  };
  return open_text_sink(uri, setup,
                        {.head = "time_s,neuron\n", .kinds = kKinds<SpikeEvent>, .append = append});
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
  return open_text_sink(uri, setup, {.head = "", .kinds = kKinds<SpikeEvent>, .append = append});
}

}  // namespace merkel
