#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

#include "core/neuron/kernel/spike_observer.hpp"
#include "core/neuron/spike_buffer.hpp"

namespace merkel {

/// Gives the spikes that a kernel tells of their probe times. Real-time: yes.
class SpikeRecorder final : public SpikeObserver {
 public:
  /// \param start  of the kernel's call.  \param step  its length
  SpikeRecorder(SpikeBuffer& spikes, std::chrono::nanoseconds start, std::chrono::nanoseconds step,
                std::uint16_t patch)
      : spikes_(spikes), start_(start), step_(step), patch_(patch) {}

  void spiked(std::size_t neuron, int step, double fraction) noexcept override {
    const double within_ns = fraction * static_cast<double>(step_.count());
    spikes_.push({.time = start_ + step * step_ + std::chrono::nanoseconds{std::llround(within_ns)},
                  .neuron = static_cast<std::uint32_t>(neuron + 1),
                  .patch = patch_,
                  .flags = 0});
  }

 private:
  SpikeBuffer& spikes_;
  std::chrono::nanoseconds start_;
  std::chrono::nanoseconds step_;
  std::uint16_t patch_;
};

}  // namespace merkel
