#pragma once

#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/spike_sink.hpp"

namespace merkel {

/// Writes spikes as a CSV table `time_s,neuron`: probe time with nine decimals, neurons from 1.
class CsvSpikeSink final : public SpikeSink {
 public:
  /// \param path  a file, "-" for the standard output, or a device
  [[nodiscard]] static Expected<std::unique_ptr<SpikeSink>, SetupError> open(
      const std::string& uri, const std::string& path, NeuronNumbering numbering, bool overwrite);

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override;
  [[nodiscard]] Expected<void, SinkError> flush() override;
  [[nodiscard]] Expected<void, SinkError> close() override;
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  CsvSpikeSink(std::string uri, OutputFile file, NeuronNumbering numbering);
  Expected<void, SinkError> settle(bool succeeded);

  std::string uri_;
  OutputFile file_;
  NeuronNumbering numbering_;
  std::string rows_;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace merkel
