#pragma once

#include <cstddef>
#include <cstdint>

#include "core/neurons/hodgkin_huxley/kernel/neuron_constants.hpp"
#include "core/neurons/step_call.hpp"

namespace merkel {

/// How a step changes the gates.
enum class GateRule : std::uint8_t {
  kCrankNicolson,  ///< x += (p − s·x)/(D + s/2), with rates per step
  kExponential,    ///< x += (x∞ − x)·(1 − e^{−dt·(α+β)})
};

/// How a step changes the potential; G and D are Σg and Σg·E + I.
enum class VoltageRule : std::uint8_t {
  kCrankNicolson,  ///< C/dt·ΔV = D − G·(V + ΔV/2)
  kBackwardEuler,  ///< C/dt·ΔV = D − G·(V + ΔV)
  kExponential,    ///< V → D/G + (V − D/G)·e^{−dt·G/C}
};

/// Exchange with up to four neighbours on a grid: the conductance κ·w to each, 0 at the borders.
template <class Real>
struct CouplingArguments {
  const Real* from_previous_column = nullptr;
  const Real* from_next_column = nullptr;
  const Real* from_previous_row = nullptr;
  const Real* from_next_row = nullptr;
  const Real* outflow = nullptr;  ///< their sum; null without a network
  std::ptrdiff_t columns = 0;
  /// V as the neighbours see it, alternately at the beginning and the end of a step, with a halo of
  /// `columns` + kNeuronBlock zeros on either side.
  Real* seen[2] = {nullptr, nullptr};
  Real lookahead = 0;             ///< seen = V + lookahead·(V − V a step ago)
  Real outflow_implicitness = 1;  ///< fraction of the outflow taken at the end of the step
};

/// The history of the multistep method: ẋ·dt of V, n, m and h in the middle of each of the last
/// three steps. Arrays as long as the neurons'.
template <class Real>
struct MultistepHistory {
  static constexpr int kSteps = 3;
  static constexpr int kArrays = 4 * kSteps;

  /// The array that step `number` since reset fills; until then it holds step number − 3.
  [[nodiscard]] Real* of(int variable, std::uint64_t number) const noexcept {
    return arrays[kSteps * variable + static_cast<int>(number % kSteps)];
  }
  Real* arrays[kArrays] = {};
};

/// Hodgkin-Huxley neurons as a structure of arrays, and the steps to take. All arrays are padded to
/// whole blocks.
template <class Real>
struct HodgkinHuxleyArguments {
  Real* V = nullptr;
  Real* n = nullptr;
  Real* m = nullptr;
  Real* h = nullptr;
  const Real* input_begin = nullptr;   ///< µA/cm² at the beginning of the first step
  const Real* input_change = nullptr;  ///< change until the end of the last step
  StepCall call;
  const NeuronConstants<Real>* constants = nullptr;
  GateRule gate_rule = GateRule::kCrankNicolson;
  VoltageRule voltage_rule = VoltageRule::kCrankNicolson;
  bool old_gates = false;                ///< V uses the gates at the beginning of the step
  Real input_phase = Real(0.5);          ///< fraction of the step at which the input is taken
  const std::uint8_t* frozen = nullptr;  ///< by block, 1 = skip; null: step all
  CouplingArguments<Real> coupling;
  int seen_at_begin = 0;  ///< index in `seen` of the beginning of the first step
  const MultistepHistory<Real>* history =
      nullptr;  ///< of the multistep method; null for other methods
};

/// Resets a neuron with a non-finite state to rest.
template <class Real>
void reset_neuron(const HodgkinHuxleyArguments<Real>& a, std::size_t neuron) noexcept {
  const NeuronConstants<Real>& c = *a.constants;
  a.V[neuron] = c.V_rest;
  a.n[neuron] = c.rest_n;
  a.m[neuron] = c.rest_m;
  a.h[neuron] = c.rest_h;
  if (a.history == nullptr) return;
  for (Real* const array : a.history->arrays) array[neuron] = Real(0);
}

/// An explicit Runge-Kutta method in which each stage depends only on the previous one: forward
/// Euler, Heun and the classical fourth-order method.
struct RungeKuttaScheme {
  static constexpr int kMaxStages = 4;
  int stages = 1;
  double time[kMaxStages] = {0.0, 0.0, 0.0, 0.0};    ///< of each stage within the step
  double weight[kMaxStages] = {1.0, 0.0, 0.0, 0.0};  ///< of each stage's slopes in the result
};

/// Memory for the stages of a Runge-Kutta step: as long as the neurons' arrays.
template <class Real>
struct RungeKuttaScratch {
  Real* stage[4] = {};    ///< trial V, n, m, h
  Real* result[4] = {};   ///< partial sums of V, n, m, h
  Real* slope = nullptr;  ///< of V at the beginning of the step, mV per step
};

/// Takes all steps with a single-stage method. Bit-identical on every instruction set. Real-time:
/// yes.
void step_hodgkin_huxley(const HodgkinHuxleyArguments<double>& arguments) noexcept;
void step_hodgkin_huxley(const HodgkinHuxleyArguments<float>& arguments) noexcept;

/// The same with a Runge-Kutta method.
void step_hodgkin_huxley(const HodgkinHuxleyArguments<double>& arguments,
                         const RungeKuttaScheme& scheme,
                         const RungeKuttaScratch<double>& scratch) noexcept;
void step_hodgkin_huxley(const HodgkinHuxleyArguments<float>& arguments,
                         const RungeKuttaScheme& scheme,
                         const RungeKuttaScratch<float>& scratch) noexcept;

/// The same with the staggered multistep method.
void step_multistep(const HodgkinHuxleyArguments<double>& arguments) noexcept;
void step_multistep(const HodgkinHuxleyArguments<float>& arguments) noexcept;

}  // namespace merkel
