#pragma once

#include <cstddef>
#include <cstdint>

#include "core/neurons/hodgkin_huxley/kernel/membrane_constants.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// Neurons are padded to whole blocks of so many, and a block is what is skipped when quiescent:
/// the width of the vectors in use changes no result.
inline constexpr std::size_t kNeuronBlock = 16;

/// Beyond this, a potential counts as non-finite: nothing the model can do leads there and back.
inline constexpr double kRunaway_mV = 1e4;

/// A potential's rise through the threshold in a step.
struct Crossing {
  std::size_t neuron = 0;  ///< from 0
  int step = 0;            ///< from the call's first
  double V_before_mV = 0.0;
  double V_after_mV = 0.0;
  bool has_slopes = false;    ///< whether the method knows V̇ at both ends
  double slope_before = 0.0;  ///< mV a step
  double slope_after = 0.0;
};

/// What a kernel tells in rare cases while it steps. All calls are real-time.
class StepObserver {
 public:
  virtual void crossed(const Crossing& crossing) noexcept = 0;
  /// The state of a neuron turned non-finite in a step; the kernel has put it to rest.
  virtual void reset(std::size_t neuron, int step) noexcept = 0;

 protected:
  ~StepObserver() = default;
};

/// How the gates go on over a step.
enum class GateRule : std::uint8_t {
  kCrankNicolson,  ///< x += (p − s·x)/(D + s/2), with rates per step
  kExponential,    ///< x += (x∞ − x)·(1 − e^{−dt·(α+β)})
};

/// How the potential goes on over a step; G and D are Σg and Σg·E + I.
enum class VoltageRule : std::uint8_t {
  kCrankNicolson,  ///< C/dt·ΔV = D − G·(V + ΔV/2)
  kBackwardEuler,  ///< C/dt·ΔV = D − G·(V + ΔV)
  kExponential,    ///< V → D/G + (V − D/G)·e^{−dt·G/C}
};

/// Exchange with the up to four neighbours of a grid: conductances κ·w to each, 0 at the borders.
template <class Real>
struct CouplingArguments {
  const Real* from_previous_column = nullptr;
  const Real* from_next_column = nullptr;
  const Real* from_previous_row = nullptr;
  const Real* from_next_row = nullptr;
  const Real* outflow = nullptr;  ///< their sum; null where there is no network
  std::ptrdiff_t columns = 0;
  /// V as neighbours see it, at the beginning and the end of a step in turn; with a halo of
  /// `columns` + kNeuronBlock zeros on either side.
  Real* seen[2] = {nullptr, nullptr};
  Real lookahead = 0;             ///< seen = V + lookahead·(V − V a step ago)
  Real outflow_implicitness = 1;  ///< how much of the outflow is taken at the step's end
};

/// Membranes as structure of arrays, and what to do with them.
template <class Real>
struct KernelArguments {
  Real* V = nullptr;
  Real* n = nullptr;
  Real* m = nullptr;
  Real* h = nullptr;
  const Real* current_begin = nullptr;   ///< µA/cm² at the first step's beginning
  const Real* current_change = nullptr;  ///< by the last step's end
  std::size_t first = 0;  ///< neurons [first, last) are stepped; first in whole blocks
  std::size_t last = 0;
  int steps = 0;
  const MembraneConstants<Real>* constants = nullptr;
  GateRule gate_rule = GateRule::kCrankNicolson;
  VoltageRule voltage_rule = VoltageRule::kCrankNicolson;
  bool old_gates = false;                ///< V uses the gates at the step's beginning
  Real current_phase = Real(0.5);        ///< where in the step the current is taken
  const std::uint8_t* frozen = nullptr;  ///< by block, 1 = skip; null where none is
  CouplingArguments<Real> coupling;
  int seen_at_begin = 0;        ///< which of `seen` holds the first step's beginning
  WorkerTeam* peers = nullptr;  ///< step the other parts at the same time; null where alone
  StepObserver* observer = nullptr;
};

/// An explicit Runge-Kutta method whose stages each start from the one before: forward Euler, Heun
/// and the classical fourth-order method.
struct RungeKuttaScheme {
  static constexpr int kMostStages = 4;
  int stages = 1;
  double time[kMostStages] = {0.0, 0.0, 0.0, 0.0};    ///< of a stage within the step
  double weight[kMostStages] = {1.0, 0.0, 0.0, 0.0};  ///< of its slopes in the result
};

/// Memory for the stages of a Runge-Kutta step: as long as the membranes' arrays.
template <class Real>
struct RungeKuttaScratch {
  Real* stage[4] = {};    ///< trial V, n, m, h
  Real* result[4] = {};   ///< V, n, m, h as far as they are summed up
  Real* slope = nullptr;  ///< of V at the step's beginning, mV a step
};

/// Takes all steps with a method that goes from V and gates to V and gates in one go.
/// Bit-identical on every instruction set. Real-time: yes.
void step_membranes(const KernelArguments<double>& arguments) noexcept;
void step_membranes(const KernelArguments<float>& arguments) noexcept;

/// Takes all steps with a Runge-Kutta method. Likewise.
void step_membranes(const KernelArguments<double>& arguments, const RungeKuttaScheme& scheme,
                    const RungeKuttaScratch<double>& scratch) noexcept;
void step_membranes(const KernelArguments<float>& arguments, const RungeKuttaScheme& scheme,
                    const RungeKuttaScratch<float>& scratch) noexcept;

}  // namespace merkel
