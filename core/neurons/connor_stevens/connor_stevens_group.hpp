#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/neurons/connor_stevens/connor_stevens_kernel.hpp"
#include "core/neurons/neuron_group.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// N Connor-Stevens neurons. The input is an injected current in µA/cm². A step of 50 µs gives
/// rates within 0.3 % of those at 20 µs.
class ConnorStevensGroup final : public NeuronGroup {
 public:
  /// The state of a neuron after a second at the holding current without noise, and the table of
  /// its gates' steps: equal in all groups of equal neurons.
  struct Rest {
    GateTable gate_table;
    double V_mV = 0.0;
    double gates[GateTable::kGates] = {};
  };
  struct Parameters {
    ConnorStevens neuron;
    std::chrono::nanoseconds step{50'000};
    double holding_current_uA_per_cm2 = 0.0;  ///< at which the neurons are at rest
    /// The noise is full from this current on. If it equals the holding current, the noise is
    /// always full.
    double full_noise_current_uA_per_cm2 = 0.0;
    std::uint16_t patch = 0;           ///< written into every spike
    std::uint32_t first_neuron = 1;    ///< number of the first neuron, used in spikes
    std::shared_ptr<const Rest> rest;  ///< from rest_of(); null: computed
  };

  /// The rest of the neurons of these parameters. Real-time: no.
  [[nodiscard]] static std::shared_ptr<const Rest> rest_of(const Parameters& parameters);

  /// \param parameters  valid
  /// \param neurons  N ≥ 1
  ConnorStevensGroup(const Parameters& parameters, std::size_t neurons);

  [[nodiscard]] double potential_mV(std::size_t neuron) const noexcept { return V_[neuron]; }
  [[nodiscard]] double potential(std::size_t neuron) const noexcept override { return V_[neuron]; }

 private:
  void set_at_rest() noexcept override;
  std::size_t take_input(std::span<const double> begin,
                         std::span<const double> end) noexcept override;
  void step_part(const StepCall& part) noexcept override;
  [[nodiscard]] ConnorStevensArguments arguments(const StepCall& part) noexcept;

  ConnorStevens neuron_;
  /// Sets a block exactly to rest if it is within 1e-3 mV (1e-5 for gates) of rest and has no
  /// input.
  [[nodiscard]] bool comes_to_rest(std::size_t block) noexcept;

  double holding_current_;
  double full_noise_current_;
  std::vector<std::uint8_t> resting_;  ///< by block
  AlignedArray<double> V_;
  AlignedArray<double> gates_[GateTable::kGates];
  LinearInput<double> input_;
  AlignedArray<std::uint64_t> noise_key_;
  std::shared_ptr<const Rest> rest_;
};

}  // namespace merkel
