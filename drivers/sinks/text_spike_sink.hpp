#pragma once

#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/sinks/time_file.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Writes spikes as lines of text, exact to the nanosecond, with neurons from 1. The file has one
/// form after every run; the conversion of its times to the probe's is in the file beside it
/// (TimeFile).
class TextSpikeSink final : public SpikeSink {
 public:
  enum class Form {
    kCsv,  ///< `time_s,neuron`, with this line as its first
    kGdf,  ///< NEST's: neuron, tab, time in ms; no header
  };

  /// \param path  a file, "-" for the standard output, or a device. Options: time
  [[nodiscard]] static Expected<std::unique_ptr<SpikeSink>, SetupError> open(
      const Uri& uri, const std::string& path, Form form, const SinkSetup& setup);

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override;
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override;
  [[nodiscard]] Expected<void, SinkError> flush() override;
  [[nodiscard]] Expected<void, SinkError> close() override;
  void give_up() noexcept override { file_.give_up(); }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  TextSpikeSink(std::string uri, OutputFile file, TimeFile time_file, Form form, TimeBase time);
  Expected<void, SinkError> settle(bool succeeded);

  std::string uri_;
  OutputFile file_;
  TimeFile time_file_;
  Form form_;
  TimeBase time_;
  bool header_written_ = false;
  std::string rows_;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace merkel
