#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/probe.hpp"

namespace merkel {

/// The strongest press that a probe may report. Beyond it, the cause is a wrong unit or a crash of
/// the stage, not a touch.
struct PressLimits {
  double force_N = 50.0;
  double depth_mm = 15.0;
};

/// The reason to refuse a sample of the named probe; empty if within the limits.
[[nodiscard]] std::string press_excess(const ProbeSample& sample, const PressLimits& limits,
                                       const std::string& name);

/// Keeps presses beyond the limits from the model. A recording with such a press ends with an
/// error; such samples of a device are dropped, counted as refused and reported.
class LimitedProbe final : public Probe {
 public:
  LimitedProbe(std::unique_ptr<Probe> probe, const PressLimits& limits)
      : probe_(std::move(probe)), limits_(limits) {}

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return probe_->info(); }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override {
    return error_message_.empty() ? probe_->error_message() : error_message_;
  }
  [[nodiscard]] const ProbeCalibration* calibration() const noexcept override {
    return probe_->calibration();
  }
  [[nodiscard]] std::optional<DeviceCounts> device_counts() const override;
  [[nodiscard]] bool is_timed() const noexcept override { return probe_->is_timed(); }
  [[nodiscard]] std::optional<SampleTiming> timing() const override { return probe_->timing(); }
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
  std::unique_ptr<Probe> probe_;
  PressLimits limits_;
  std::string error_message_;
  mutable std::mutex mutex_;  ///< guards the rest
  std::uint64_t refused_ = 0;
  std::optional<std::string> notice_;
};

}  // namespace merkel
