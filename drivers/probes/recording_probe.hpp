#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/files/trace_file.hpp"
#include "drivers/probe.hpp"

namespace merkel {

/// A probe whose samples are also written to a trace as they are read, so that a run with a device
/// can be replayed. A trace that cannot be written on ends the stream.
class RecordingProbe final : public Probe {
 public:
  RecordingProbe(std::unique_ptr<Probe> probe, TraceWriter trace)
      : probe_(std::move(probe)), trace_(std::move(trace)) {}
  ~RecordingProbe() override { static_cast<void>(trace_.close()); }

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return probe_->info(); }

  [[nodiscard]] Expected<std::size_t, ProbeError> read(
      std::span<ProbeSample> samples, std::chrono::milliseconds patience) override {
    auto count = probe_->read(samples, patience);
    if (!count || *count == 0) return count;
    if (auto written = trace_.write(samples.first(*count)); !written) {
      trouble_ = written.error().sentence;
      return Unexpected<ProbeError>(ProbeError::kBadData);
    }
    return count;
  }
  [[nodiscard]] std::string trouble() const override {
    return trouble_.empty() ? probe_->trouble() : trouble_;
  }
  [[nodiscard]] std::optional<DeviceCounts> device_counts() const override {
    return probe_->device_counts();
  }
  [[nodiscard]] bool is_timed() const noexcept override { return probe_->is_timed(); }
  [[nodiscard]] std::optional<SampleTiming> timing() const override { return probe_->timing(); }
  [[nodiscard]] std::vector<std::string> take_notices() override { return probe_->take_notices(); }
  [[nodiscard]] std::size_t ports() const noexcept override { return probe_->ports(); }
  void add_listener(std::size_t port, PortListener& listener) override {
    probe_->add_listener(port, listener);
  }
  void remove_listener(std::size_t port, PortListener& listener) override {
    probe_->remove_listener(port, listener);
  }

 private:
  std::unique_ptr<Probe> probe_;
  TraceWriter trace_;
  std::string trouble_;
};

}  // namespace merkel
