#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/files/npy_file.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "drivers/spike_sink.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Writes spikes as a folder that Phy and Neo read: `spike_times.npy` (samples of 1 µs, or of what
/// the option sample_rate says), `spike_clusters.npy` and `spike_templates.npy` (neurons from 1),
/// and `params.py`. Every flush leaves whole files.
class PhySpikeSink final : public SpikeSink {
 public:
  /// Makes the folder the URI's path names; its parent must exist.
  [[nodiscard]] static Expected<std::unique_ptr<SpikeSink>, SetupError> open(
      const Uri& uri, const SinkSetup& setup);
  /// Takes the folder away again if nothing was written and close() was not called.
  ~PhySpikeSink() override;

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override;
  [[nodiscard]] Expected<void, SinkError> flush() override;
  [[nodiscard]] Expected<void, SinkError> close() override;
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  PhySpikeSink(std::string uri, double sample_rate_hz, NpyFile times, NpyFile clusters,
               NpyFile templates);
  Expected<void, SinkError> settle(bool succeeded);

  std::string uri_;
  double sample_rate_hz_;
  NpyFile times_;
  NpyFile clusters_;
  NpyFile templates_;
  std::string folder_;  ///< where this sink has made it
  bool closed_ = false;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace merkel
