#pragma once

#include <atomic>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/units.hpp"
#include "drivers/simulation/device_simulator.hpp"

namespace merkel {

/// A press of `count` samples, 1 ms apart, with values that every device can represent exactly.
inline std::vector<ProbeSample> dyadic_press(std::size_t count) {
  std::vector<ProbeSample> trace;
  for (std::size_t i = 0; i < count; ++i) {
    ProbeSample sample{.channels = ProbeSample::kDepth | ProbeSample::kForce};
    sample.time = sample.arrival = std::chrono::milliseconds{i};
    sample.depth_mm = 0.125 * static_cast<double>((i / 8) % 13);
    sample.force_mN = units::mN_from_N(0.125 * static_cast<double>((i / 8) % 7));
    sample.sequence = static_cast<std::uint32_t>(i);
    trace.push_back(sample);
  }
  return trace;
}

/// A simulated device that plays in its own thread during its lifetime.
class RunningDevice {
 public:
  explicit RunningDevice(DeviceSimulator::Settings settings) {
    auto made = DeviceSimulator::create(std::move(settings));
    if (!made) throw std::runtime_error(made.error().sentence);
    simulator_ = std::move(*made);
    uri_ = simulator_->uri();
    thread_ = std::jthread([this] { simulator_->run(stop_); });
  }
  RunningDevice(std::string_view protocol, const SimulatedFaults& faults, std::string link = {})
      : RunningDevice(DeviceSimulator::Settings{.protocol = *find_protocol(protocol),
                                                .trace = dyadic_press(20'000),
                                                .baud = (*find_protocol(protocol))->baud,
                                                .link = std::move(link),
                                                .faults = faults}) {}
  RunningDevice(const RunningDevice&) = delete;
  RunningDevice& operator=(const RunningDevice&) = delete;
  ~RunningDevice() { finish(); }

  [[nodiscard]] const std::string& uri() const { return uri_; }
  /// Stops the device and returns its counters.
  const DeviceSimulator::Counts& finish() {
    stop_.store(true);
    if (thread_.joinable()) thread_.join();
    return simulator_->counts();
  }

 private:
  std::unique_ptr<DeviceSimulator> simulator_;
  std::string uri_;
  std::atomic<bool> stop_{false};
  std::jthread thread_;
};

}  // namespace merkel
