#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/probe.hpp"

namespace merkel {

/// A probe in front of another one, which it owns. Passes every call on: a probe that changes some
/// of them derives from it, and cannot forget the others.
class ForwardingProbe : public Probe {
 public:
  explicit ForwardingProbe(std::unique_ptr<Probe> probe) : probe_(std::move(probe)) {}

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return probe_->info(); }
  [[nodiscard]] std::size_t outputs() const noexcept override { return probe_->outputs(); }
  [[nodiscard]] const ProbeInfo& info_of(std::size_t output) const noexcept override {
    return probe_->info_of(output);
  }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(
      std::span<ProbeSample> samples, std::chrono::milliseconds patience) override {
    return probe_->read(samples, patience);
  }
  [[nodiscard]] std::span<const float> taxels(const ProbeSample& sample) const override {
    return probe_->taxels(sample);
  }
  [[nodiscard]] std::string error_message() const override { return probe_->error_message(); }
  [[nodiscard]] std::optional<DeviceCounts> device_counts() const override {
    return probe_->device_counts();
  }
  [[nodiscard]] bool is_timed() const noexcept override { return probe_->is_timed(); }
  [[nodiscard]] std::optional<SampleTiming> timing() const override { return probe_->timing(); }
  [[nodiscard]] const ProbeCalibration* calibration() const noexcept override {
    return probe_->calibration();
  }
  [[nodiscard]] std::vector<std::string> take_notices() override { return probe_->take_notices(); }
  [[nodiscard]] bool request_tare(std::size_t output) noexcept override {
    return probe_->request_tare(output);
  }
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
};

}  // namespace merkel
