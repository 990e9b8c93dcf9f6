#pragma once

#include <chrono>
#include <cstdint>
#include <span>

#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/neurons/connor_stevens/connor_stevens_kernel.hpp"
#include "core/neurons/neuron_group.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// N Connor-Stevens neurons. Their input is an injected current in µA/cm². A step of 50 µs gives
/// rates within 0.3 % of one of 20 µs.
class ConnorStevensGroup final : public NeuronGroup {
 public:
  struct Parameters {
    ConnorStevens neuron;
    std::chrono::nanoseconds step{50'000};
    double holding_current_uA_per_cm2 = 0.0;  ///< under which the neurons are at rest
    /// From which on the noise is full; the holding current: always.
    double full_noise_current_uA_per_cm2 = 0.0;
    std::uint16_t patch = 0;         ///< written into every spike
    std::uint32_t first_neuron = 1;  ///< number of the first neuron in spikes
  };

  /// \param parameters  valid.  \param neurons  N ≥ 1
  ConnorStevensGroup(const Parameters& parameters, std::size_t neurons);

  [[nodiscard]] double potential_mV(std::size_t neuron) const noexcept { return V_[neuron]; }
  [[nodiscard]] double potential(std::size_t neuron) const noexcept override { return V_[neuron]; }

 private:
  void put_to_rest() noexcept override;
  std::size_t take_input(std::span<const double> begin,
                         std::span<const double> end) noexcept override;
  void step_part(const StepCall& part) noexcept override;
  [[nodiscard]] ConnorStevensArguments arguments(const StepCall& part) noexcept;

  ConnorStevens neuron_;
  /// Puts a block to rest exactly, where it is within 1e-3 mV (1e-5 for gates) of it and nothing
  /// drives it.
  [[nodiscard]] bool comes_to_rest(std::size_t block) noexcept;

  double holding_current_;
  double full_noise_current_;
  std::vector<std::uint8_t> resting_;  ///< of each block
  GateTable gate_table_;
  AlignedArray<double> V_;
  AlignedArray<double> gates_[GateTable::kGates];
  LinearInput<double> input_;
  AlignedArray<std::uint64_t> noise_key_;
  double resting_V_mV_ = -68.0;
  double resting_gates_[GateTable::kGates] = {};
};

}  // namespace merkel
