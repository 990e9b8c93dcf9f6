#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/integration_method.hpp"
#include "core/neurons/hodgkin_huxley/kernel/hodgkin_huxley_kernel.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/neurons/hodgkin_huxley/resting_states.hpp"
#include "core/neurons/neuron_arrays.hpp"
#include "core/realtime_tag.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// The states of N neurons as a structure of arrays in one precision, and the kernel call that
/// steps them. Real-time: yes, after construction.
template <class Real>
class HodgkinHuxleyArrays {
 public:
  HodgkinHuxleyArrays(const HodgkinHuxley& neuron, IntegrationMethod method, double step_ms,
                      std::size_t neurons, const std::optional<LatticeCoupling>& network);

  void set_input(std::span<const double> begin, std::span<const double> end) noexcept {
    input_.set(begin, end);
  }

  /// Takes the steps of a call. The parts of a network step in lockstep: each waits for its peers
  /// after each exchange.
  /// \param frozen  by block: 1 = skip; null: step all
  void step(const StepCall& call, const std::uint8_t* frozen) noexcept MERKEL_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return neurons_; }
  [[nodiscard]] RestingStates::State state(std::size_t neuron) const noexcept;
  void set_state(std::size_t neuron, const RestingStates::State& state) noexcept;
  /// Current from the neighbours, µA/cm²; 0 without a network.
  /// \param steps_taken  since reset
  [[nodiscard]] double exchange(std::size_t neuron, std::uint64_t steps_taken) const noexcept;

 private:
  void set_up_method(IntegrationMethod method, double step_ms, double capacitance,
                     const std::optional<LatticeCoupling>& network);
  void set_up_network(const LatticeCoupling& network);
  /// Index in coupling.seen of the beginning of the step that follows `steps` steps.
  [[nodiscard]] int seen_after(std::uint64_t steps) const noexcept;

  NeuronConstants<Real> constants_;
  std::size_t neurons_;
  AlignedArray<Real> V_, n_, m_, h_;
  LinearInput<Real> input_;
  AlignedArray<Real> from_previous_column_, from_next_column_, from_previous_row_, from_next_row_;
  AlignedArray<Real> outflow_;
  AlignedArray<Real> seen_[2];
  std::optional<RungeKuttaScheme> runge_kutta_;
  AlignedArray<Real> scratch_memory_[9];
  RungeKuttaScratch<Real> scratch_;
  AlignedArray<Real> history_memory_[MultistepHistory<Real>::kArrays];
  MultistepHistory<Real> history_;  ///< of the multistep method; null for other methods
  HodgkinHuxleyArguments<Real> arguments_;
};

extern template class HodgkinHuxleyArrays<double>;
extern template class HodgkinHuxleyArrays<float>;

}  // namespace merkel
