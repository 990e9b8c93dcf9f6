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

/// Exchange with the up to four neighbours of a grid: conductances κ·w to each,
/// 0 at the borders.
template <class Real>
struct CouplingArguments {
  const Real* from_previous_column = nullptr;
  const Real* from_next_column = nullptr;
  const Real* from_previous_row = nullptr;
  const Real* from_next_row = nullptr;
  const Real* outflow = nullptr;  ///< their sum; null where there is no network
  std::ptrdiff_t columns = 0;
  /// V as neighbours see it, at the beginning and the end of a step in turn;
  /// with a halo of `columns` + kNeuronBlock zeros on either side.
  Real* seen[2] = {nullptr, nullptr};
  Real lookahead = 0;             ///< seen = V + lookahead·(V − V a step ago)
  Real outflow_implicitness = 1;  ///< how much of the outflow is taken at the step's end
};

/// What the multistep method keeps of the last three steps: ẋ·dt in the middle
/// of each, of V, n, m and h. Arrays as long as the neurons'.
template <class Real>
struct MultistepHistory {
  static constexpr int kSteps = 3;
  static constexpr int kArrays = 4 * kSteps;

  /// The array that step `number` since reset fills; before, it holds step
  /// number − 3.
  [[nodiscard]] Real* of(int variable, std::uint64_t number) const noexcept {
    return arrays[kSteps * variable + static_cast<int>(number % kSteps)];
  }
  Real* arrays[kArrays] = {};
};

/// Hodgkin-Huxley neurons as structure of arrays, and what to do with them. All
/// arrays are padded to whole blocks.
template <class Real>
struct HodgkinHuxleyArguments {
  Real* V = nullptr;
  Real* n = nullptr;
  Real* m = nullptr;
  Real* h = nullptr;
  const Real* input_begin = nullptr;   ///< µA/cm² at the first step's beginning
  const Real* input_change = nullptr;  ///< by the last step's end
  StepCall call;
  const NeuronConstants<Real>* constants = nullptr;
  GateRule gate_rule = GateRule::kCrankNicolson;
  VoltageRule voltage_rule = VoltageRule::kCrankNicolson;
  bool old_gates = false;                ///< V uses the gates at the step's beginning
  Real input_phase = Real(0.5);          ///< where in the step the input is taken
  const std::uint8_t* frozen = nullptr;  ///< by block, 1 = skip; null where none is
  CouplingArguments<Real> coupling;
  int seen_at_begin = 0;  ///< which of `seen` holds the first step's beginning
  const MultistepHistory<Real>* history = nullptr;  ///< of the multistep method; else null
};

/// An explicit Runge-Kutta method whose stages each start from the one before:
/// forward Euler, Heun and the classical fourth-order method.
struct RungeKuttaScheme {
  static constexpr int kMostStages = 4;
  int stages = 1;
  double time[kMostStages] = {0.0, 0.0, 0.0, 0.0};    ///< of a stage within the step
  double weight[kMostStages] = {1.0, 0.0, 0.0, 0.0};  ///< of its slopes in the result
};

/// Memory for the stages of a Runge-Kutta step: as long as the neurons' arrays.
template <class Real>
struct RungeKuttaScratch {
  Real* stage[4] = {};    ///< trial V, n, m, h
  Real* result[4] = {};   ///< V, n, m, h as far as they are summed up
  Real* slope = nullptr;  ///< of V at the step's beginning, mV a step
};

/// Takes all steps with a method that goes from V and gates to V and gates in
/// one go. Bit-identical on every instruction set. Real-time: yes.
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
