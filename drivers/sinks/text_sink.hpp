#pragma once

#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/file_sink.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/sinks/time_file.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Writes spikes as lines of text, exact to the nanosecond, with neurons from 1. The file has one
/// form after every run; the conversion of its times to the probe's is in the file beside it
/// (TimeFile).
class TextSink final : public FileSink {
 public:
  enum class Form {
    kCsv,  ///< `time_s,neuron`, with this line as its first
    kGdf,  ///< NEST's: neuron, tab, time in ms; no header
  };

  /// \param path  a file, "-" for the standard output, or a device. Options: time
  [[nodiscard]] static Expected<std::unique_ptr<Sink>, SetupError> open(const Uri& uri,
                                                                        const std::string& path,
                                                                        Form form,
                                                                        const SinkSetup& setup);

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override;

 private:
  TextSink(std::string uri, OutputFile file, TimeFile time_file, Form form, TimeBase time);
  [[nodiscard]] Expected<void, SinkError> start(const RunOrigin& origin) override;

  TimeFile time_file_;
  Form form_;
  TimeBase time_;
  std::string rows_;
};

}  // namespace merkel
