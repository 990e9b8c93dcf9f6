#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <variant>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley_arrays.hpp"
#include "core/neurons/hodgkin_huxley/integration_method.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/neurons/hodgkin_huxley/quiescence.hpp"
#include "core/neurons/hodgkin_huxley/resting_states.hpp"
#include "core/neurons/neuron_group.hpp"

namespace merkel {

/// N Hodgkin-Huxley neurons, with or without a network between them. The input is a current in
/// µA/cm².
///
/// C·V̇ = Σ ionic + I + κΣ_j w_nj(V_j − V_n) (Eq. 11, corrected). A spike is an upward crossing of
/// the threshold; its time is interpolated within the step. If a neuron's state turns non-finite,
/// the neuron is reset to rest and reported before its neighbours see it. Blocks of 16 neurons that
/// are at rest under a constant current are skipped until something changes.
class HodgkinHuxleyGroup final : public NeuronGroup {
 public:
  struct Parameters {
    HodgkinHuxley neuron;
    IntegrationMethod method = IntegrationMethod::kCrankNicolson;
    Precision precision = Precision::kDouble;
    std::chrono::nanoseconds step{25'000};
    std::uint16_t patch = 0;         ///< written into every spike
    std::uint32_t first_neuron = 1;  ///< number of the first neuron, used in spikes
    bool freeze_resting = true;      ///< skip blocks at rest
    /// Of the neuron, for freeze_resting; null: computed, which takes about 20 ms.
    std::shared_ptr<const RestingStates> resting_states;
  };

  /// \param neurons  N ≥ 1
  /// \param network  a grid of N neurons, or none; a network with gain 0 counts as none
  HodgkinHuxleyGroup(const Parameters& parameters, std::size_t neurons,
                     const std::optional<LatticeCoupling>& network);

  [[nodiscard]] double potential_mV(std::size_t neuron) const noexcept;
  [[nodiscard]] double potential(std::size_t neuron) const noexcept override {
    return potential_mV(neuron);
  }
  [[nodiscard]] Gates gates(std::size_t neuron) const noexcept;
  /// Sets one neuron's state; for tests and for starting from a recorded state.
  void set_state(std::size_t neuron, double V_mV, const Gates& gates) noexcept;

 private:
  void set_at_rest() noexcept override;
  std::size_t take_input(std::span<const double> begin,
                         std::span<const double> end) noexcept override;
  void step_part(const StepCall& part) noexcept override;

  HodgkinHuxley neuron_;
  std::variant<HodgkinHuxleyArrays<double>, HodgkinHuxleyArrays<float>> arrays_;
  std::optional<Quiescence> quiescence_;  ///< none if blocks at rest are stepped too
};

}  // namespace merkel
