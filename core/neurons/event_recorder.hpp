#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

#include "core/neurons/hodgkin_huxley/kernel/membrane_kernel.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/neurons/spike_detector.hpp"
#include "core/neurons/spike_observer.hpp"
#include "core/records/spike_event.hpp"

namespace merkel {

/// The times of a kernel's call: turns a neuron and a place within a step into an event.
struct StepTimes {
  std::chrono::nanoseconds start{0};  ///< of the call
  std::chrono::nanoseconds step{0};   ///< length
  std::uint16_t patch = 0;            ///< written into every event

  /// \param neuron  from 0.  \param number  of the step, from 0.  \param fraction  of it
  [[nodiscard]] SpikeEvent event(std::size_t neuron, int number, double fraction) const noexcept {
    const double within_ns = fraction * static_cast<double>(step.count());
    return {.time = start + number * step + std::chrono::nanoseconds{std::llround(within_ns)},
            .neuron = static_cast<std::uint32_t>(neuron + 1),
            .patch = patch,
            .flags = 0};
  }
};

/// Collects the spikes that a kernel of noisy neurons tells of. Real-time: yes.
class SpikeRecorder final : public SpikeObserver {
 public:
  SpikeRecorder(const StepTimes& times, SpikeBuffer& spikes) : times_(times), spikes_(spikes) {}

  void spiked(std::size_t neuron, int step, double fraction) noexcept override {
    spikes_.push(times_.event(neuron, step, fraction));
  }

 private:
  StepTimes times_;
  SpikeBuffer& spikes_;
};

/// Collects the threshold crossings and resets that a kernel of membranes tells of. Real-time: yes.
class MembraneRecorder final : public StepObserver {
 public:
  MembraneRecorder(const StepTimes& times, double threshold_mV, SpikeBuffer& spikes,
                   SpikeBuffer& resets)
      : times_(times), threshold_mV_(threshold_mV), spikes_(spikes), resets_(resets) {}

  void crossed(const Crossing& at) noexcept override {
    const double fraction = at.has_slopes
                                ? hermite_crossing(at.V_before_mV, at.slope_before, at.V_after_mV,
                                                   at.slope_after, threshold_mV_)
                                : linear_crossing(at.V_before_mV, at.V_after_mV, threshold_mV_);
    spikes_.push(times_.event(at.neuron, at.step, fraction));
  }
  void reset(std::size_t neuron, int step) noexcept override {
    resets_.push(times_.event(neuron, step, 1.0));
  }

 private:
  StepTimes times_;
  double threshold_mV_;
  SpikeBuffer& spikes_;
  SpikeBuffer& resets_;
};

}  // namespace merkel
