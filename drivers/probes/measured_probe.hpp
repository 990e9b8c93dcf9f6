#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/probe.hpp"
#include "drivers/probes/sample_meter.hpp"

namespace merkel {

/// A device whose samples are timed as they are read (SampleMeter). The loop derives its buffer
/// from timing(); each sample carries the time for which it is valid without a successor.
class MeasuredProbe final : public Probe {
 public:
  explicit MeasuredProbe(std::unique_ptr<Probe> probe) : probe_(std::move(probe)) {}

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return probe_->info(); }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override { return probe_->error_message(); }
  [[nodiscard]] const ProbeCalibration* calibration() const noexcept override {
    return probe_->calibration();
  }
  [[nodiscard]] std::optional<DeviceCounts> device_counts() const override {
    return probe_->device_counts();
  }
  [[nodiscard]] bool is_timed() const noexcept override { return true; }
  [[nodiscard]] std::optional<SampleTiming> timing() const override;
  [[nodiscard]] std::vector<std::string> take_notices() override;
  [[nodiscard]] bool request_tare() noexcept override { return probe_->request_tare(); }
  [[nodiscard]] bool connected() const noexcept override { return probe_->connected(); }
  [[nodiscard]] std::size_t ports() const noexcept override { return probe_->ports(); }
  void add_listener(std::size_t port, PortListener& listener) override {
    probe_->add_listener(port, listener);
  }
  void remove_listener(std::size_t port, PortListener& listener) override {
    probe_->remove_listener(port, listener);
  }

 private:
  void publish(bool first);

  std::unique_ptr<Probe> probe_;
  SampleMeter meter_;
  mutable std::mutex mutex_;  ///< guards the rest
  std::optional<SampleTiming> timing_;
  std::vector<std::string> notices_;
};

}  // namespace merkel
