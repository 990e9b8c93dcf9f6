#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

#include "core/neuron/kernel/membrane_kernel.hpp"
#include "core/neuron/spike_buffer.hpp"
#include "core/neuron/spike_detector.hpp"
#include "core/spike_event.hpp"

namespace merkel {

/// Turns what a kernel tells into spike and reset events with probe times. Real-time: yes.
class EventRecorder final : public StepObserver {
 public:
  EventRecorder(SpikeBuffer& spikes, SpikeBuffer& resets) : spikes_(&spikes), resets_(&resets) {}

  /// For the next call of a kernel.
  void begin(std::chrono::nanoseconds start, std::chrono::nanoseconds step, double threshold_mV,
             std::uint16_t patch) noexcept {
    start_ = start;
    step_ = step;
    threshold_mV_ = threshold_mV;
    patch_ = patch;
  }
  void crossed(const Crossing& at) noexcept override {
    const double fraction = at.has_slopes
                                ? hermite_crossing(at.V_before_mV, at.slope_before, at.V_after_mV,
                                                   at.slope_after, threshold_mV_)
                                : linear_crossing(at.V_before_mV, at.V_after_mV, threshold_mV_);
    spikes_->push(event(at.neuron, at.step, fraction));
  }
  void reset(std::size_t neuron, int step) noexcept override {
    resets_->push(event(neuron, step, 1.0));
  }

 private:
  [[nodiscard]] SpikeEvent event(std::size_t neuron, int step, double fraction) const noexcept {
    const double within_ns = fraction * static_cast<double>(step_.count());
    return {.time = start_ + step * step_ + std::chrono::nanoseconds{std::llround(within_ns)},
            .neuron = static_cast<std::uint32_t>(neuron + 1),
            .patch = patch_,
            .flags = 0};
  }

  SpikeBuffer* spikes_;
  SpikeBuffer* resets_;
  std::chrono::nanoseconds start_{0};
  std::chrono::nanoseconds step_{0};
  double threshold_mV_ = 0.0;
  std::uint16_t patch_ = 0;
};

}  // namespace merkel
