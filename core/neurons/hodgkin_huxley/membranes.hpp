#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/integration_method.hpp"
#include "core/neurons/hodgkin_huxley/kernel/membrane_kernel.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/neurons/hodgkin_huxley/resting_states.hpp"
#include "core/realtime_tag.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// The states of N neurons as structure of arrays in one precision, and the call of the kernel that
/// steps them. Real-time: yes, after construction.
template <class Real>
class Membranes {
 public:
  Membranes(const HodgkinHuxley& neuron, IntegrationMethod method, double step_ms,
            std::size_t neurons, const std::optional<LatticeCoupling>& network);

  void set_currents(std::span<const double> begin, std::span<const double> end) noexcept;

  /// Takes all steps of the neurons [first, last); first begins a block. Parts of a network step
  /// together: each waits for its peers after each exchange. \param peers  null: alone
  void step(std::size_t first, std::size_t last, int steps, const std::uint8_t* frozen,
            StepObserver& observer, WorkerTeam* peers) noexcept MERKEL_REALTIME;
  /// After all parts have stepped.
  void finish_steps(int steps) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return neurons_; }
  [[nodiscard]] RestingStates::State state(std::size_t neuron) const noexcept;
  void set_state(std::size_t neuron, const RestingStates::State& state) noexcept;
  /// Current from the neighbours, µA/cm²; 0 without a network.
  [[nodiscard]] double exchange(std::size_t neuron) const noexcept;

 private:
  void set_up_method(IntegrationMethod method, double step_ms, double capacitance,
                     const std::optional<LatticeCoupling>& network);
  void set_up_network(const LatticeCoupling& network);

  MembraneConstants<Real> constants_;
  std::size_t neurons_;
  AlignedArray<Real> V_, n_, m_, h_;
  AlignedArray<Real> current_begin_, current_change_;
  AlignedArray<Real> from_previous_column_, from_next_column_, from_previous_row_, from_next_row_;
  AlignedArray<Real> outflow_;
  AlignedArray<Real> seen_[2];
  std::optional<RungeKuttaScheme> runge_kutta_;
  AlignedArray<Real> scratch_memory_[9];
  RungeKuttaScratch<Real> scratch_;
  KernelArguments<Real> arguments_;
};

extern template class Membranes<double>;
extern template class Membranes<float>;

}  // namespace merkel
