#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "core/expected.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/file_sink.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/sinks/time_file.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Writes records as lines of text. The file has one form after every run; the conversion of its
/// times to the probe's is in the file beside it (TimeFile).
class TextSink final : public FileSink {
 public:
  struct Form {
    std::string head;     ///< the first lines
    std::uint32_t kinds;  ///< of records (kKinds)
    bool at_once;         ///< each batch is written out
    /// Appends the lines of a batch. \return the number of its spikes
    std::function<std::size_t(std::string& lines, const RecordBatch& batch, const TimeBase& time)>
        append;
  };

  /// Opens FILE, "-" for the standard output, or a device. Options: time
  [[nodiscard]] static OpenedSink open(const Uri& uri, const SinkSetup& setup, Form form);

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override { return form_.kinds; }
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override;

 private:
  TextSink(std::string uri, OutputFile file, TimeFile time_file, TimeBase time, Form form);
  [[nodiscard]] Expected<void, SinkError> start(const RunOrigin& origin) override;

  TimeFile time_file_;
  TimeBase time_;
  Form form_;
  std::string lines_;
};

}  // namespace merkel
