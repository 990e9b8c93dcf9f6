#pragma once

#include <chrono>
#include <cstdint>
#include <span>

#include "core/neurons/integrate_and_fire/integrate_and_fire.hpp"
#include "core/neurons/neuron_group.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// N integrate-and-fire neurons. The input is a drive in Hz. A neuron at rest is at the reset
/// value, outside its refractory period.
class IntegrateAndFireGroup final : public NeuronGroup {
 public:
  struct Parameters {
    IntegrateAndFire neuron;
    std::chrono::nanoseconds step{500'000};
    std::uint16_t patch = 0;         ///< written into every spike
    std::uint32_t first_neuron = 1;  ///< number of the first neuron, used in spikes
  };

  /// \param parameters  valid
  /// \param neurons  N ≥ 1
  IntegrateAndFireGroup(const Parameters& parameters, std::size_t neurons);

  /// v of a neuron; `neuron` counts from 0.
  [[nodiscard]] double potential(std::size_t neuron) const noexcept override { return v_[neuron]; }

 private:
  void set_at_rest() noexcept override;
  std::size_t take_input(std::span<const double> begin,
                         std::span<const double> end) noexcept override;
  void step_part(const StepCall& part) noexcept override;

  IntegrateAndFire neuron_;
  [[nodiscard]] bool at_rest(std::size_t block) const noexcept;

  AlignedArray<double> v_, refractory_left_;
  LinearInput<double> input_;
  std::vector<std::uint8_t> resting_;  ///< by block
  AlignedArray<std::uint64_t> noise_key_;
};

}  // namespace merkel
