#include "core/neurons/hodgkin_huxley/hodgkin_huxley_arrays.hpp"

#include <algorithm>
#include <iterator>

namespace merkel {
namespace {

std::optional<RungeKuttaScheme> scheme_of(IntegrationMethod method) {
  switch (method) {
    case IntegrationMethod::kForwardEuler:
      return RungeKuttaScheme{};
    case IntegrationMethod::kHeun:
      return RungeKuttaScheme{
          .stages = 2, .time = {0.0, 1.0, 0.0, 0.0}, .weight = {0.5, 0.5, 0.0, 0.0}};
    case IntegrationMethod::kRk4:
      return RungeKuttaScheme{.stages = 4,
                              .time = {0.0, 0.5, 0.5, 1.0},
                              .weight = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0}};
    default:
      return std::nullopt;
  }
}

}  // namespace

template <class Real>
HodgkinHuxleyArrays<Real>::HodgkinHuxleyArrays(const HodgkinHuxley& neuron,
                                               IntegrationMethod method, double step_ms,
                                               std::size_t neurons,
                                               const std::optional<LatticeCoupling>& network)
    : constants_(neuron, step_ms),
      neurons_(neurons),
      V_(whole_blocks(neurons)),
      n_(whole_blocks(neurons)),
      m_(whole_blocks(neurons)),
      h_(whole_blocks(neurons)),
      input_(neurons),
      runge_kutta_(scheme_of(method)) {
  if (network) set_up_network(*network);
  set_up_method(method, step_ms, neuron.capacitance_uF_per_cm2, network);
  const RestingStates::State rest{.V = neuron.V_rest, .gates = neuron.steady_gates(neuron.V_rest)};
  for (std::size_t i = 0; i < V_.size(); ++i) set_state(i, rest);
}

template <class Real>
void HodgkinHuxleyArrays<Real>::set_up_network(const LatticeCoupling& network) {
  const std::size_t columns = network.columns();
  for (AlignedArray<Real>* const array : {&from_previous_column_, &from_next_column_,
                                          &from_previous_row_, &from_next_row_, &outflow_}) {
    *array = AlignedArray<Real>(V_.size());
  }
  for (std::size_t i = 0; i < neurons_; ++i) {
    const auto to_column = static_cast<Real>(network.to_next_column()[i]);
    const auto to_row = static_cast<Real>(network.to_next_row()[i]);
    from_next_column_[i] = to_column;
    from_next_row_[i] = to_row;
    if (i + 1 < neurons_) from_previous_column_[i + 1] = to_column;
    if (i + columns < neurons_) from_previous_row_[i + columns] = to_row;
    outflow_[i] = static_cast<Real>(network.conductance()[i]);
  }
  // A halo of whole blocks, so that the data begins at a cache line.
  const std::size_t halo = whole_blocks(columns + kNeuronBlock);
  for (AlignedArray<Real>& seen : seen_) seen = AlignedArray<Real>(V_.size() + 2 * halo);
  CouplingArguments<Real>& coupling = arguments_.coupling;
  coupling.columns = static_cast<std::ptrdiff_t>(columns);
  for (int side = 0; side < 2; ++side) coupling.seen[side] = seen_[side].data() + halo;
}

template <class Real>
void HodgkinHuxleyArrays<Real>::set_up_method(IntegrationMethod method, double step_ms,
                                              double capacitance,
                                              const std::optional<LatticeCoupling>& network) {
  HodgkinHuxleyArguments<Real>& a = arguments_;
  a.gate_rule = step_ms < kExponentialGates_ms ? GateRule::kCrankNicolson : GateRule::kExponential;
  CouplingArguments<Real>& coupling = a.coupling;
  const bool staggered =
      method == IntegrationMethod::kCrankNicolson || method == IntegrationMethod::kRushLarsen;
  const bool weak =
      network && network->largest_conductance() * step_ms / capacitance <= kLargestExchange;
  coupling.lookahead = Real(staggered && weak ? 0.5 : 0.0);
  coupling.outflow_implicitness = Real(staggered && weak ? 0.5 : 1.0);
  switch (method) {
    case IntegrationMethod::kCrankNicolson:
      break;
    case IntegrationMethod::kRushLarsen:
      a.gate_rule = GateRule::kExponential;
      a.voltage_rule = VoltageRule::kExponential;
      break;
    case IntegrationMethod::kExponentialEuler:
      a.gate_rule = GateRule::kExponential;
      a.voltage_rule = VoltageRule::kExponential;
      a.old_gates = true;
      a.input_phase = Real(0);
      break;
    case IntegrationMethod::kBackwardEuler:
      a.gate_rule = GateRule::kExponential;
      a.voltage_rule = VoltageRule::kBackwardEuler;
      a.input_phase = Real(1);
      break;
    case IntegrationMethod::kForwardEuler:
    case IntegrationMethod::kHeun:
    case IntegrationMethod::kRk4:
      coupling.lookahead = Real(0);
      break;
    case IntegrationMethod::kStaggeredMultistep:
      for (std::size_t k = 0; k < std::size(history_memory_); ++k) {
        history_memory_[k] = AlignedArray<Real>(V_.size());
        history_.arrays[k] = history_memory_[k].data();
      }
      break;
  }
  if (!runge_kutta_) return;
  for (AlignedArray<Real>& memory : scratch_memory_) memory = AlignedArray<Real>(V_.size());
  for (std::size_t k = 0; k < 4; ++k) {
    scratch_.stage[k] = scratch_memory_[k].data();
    scratch_.result[k] = scratch_memory_[4 + k].data();
  }
  scratch_.slope = scratch_memory_[8].data();
}

template <class Real>
void HodgkinHuxleyArrays<Real>::step(const StepCall& call, const std::uint8_t* frozen) noexcept {
  // The pointers are set on every call, because moving the object moves the arrays.
  HodgkinHuxleyArguments<Real> a = arguments_;
  a.V = V_.data();
  a.n = n_.data();
  a.m = m_.data();
  a.h = h_.data();
  a.input_begin = input_.begin.data();
  a.input_change = input_.change.data();
  a.call = call;
  a.constants = &constants_;
  a.frozen = frozen;
  a.seen_at_begin = seen_after(call.steps_before);
  if (outflow_.size() > 0) {
    a.coupling.from_previous_column = from_previous_column_.data();
    a.coupling.from_next_column = from_next_column_.data();
    a.coupling.from_previous_row = from_previous_row_.data();
    a.coupling.from_next_row = from_next_row_.data();
    a.coupling.outflow = outflow_.data();
  } else {
    a.call.peers = nullptr;
  }
  a.history = history_.arrays[0] == nullptr ? nullptr : &history_;
  if (runge_kutta_) {
    step_hodgkin_huxley(a, *runge_kutta_, scratch_);
  } else if (a.history != nullptr) {
    step_multistep(a);
  } else {
    step_hodgkin_huxley(a);
  }
}

template <class Real>
int HodgkinHuxleyArrays<Real>::seen_after(std::uint64_t steps) const noexcept {
  const std::uint64_t exchanges_a_step =
      runge_kutta_ ? static_cast<std::uint64_t>(runge_kutta_->stages) : 1;
  return static_cast<int>(steps * exchanges_a_step % 2);
}

template <class Real>
RestingStates::State HodgkinHuxleyArrays<Real>::state(std::size_t i) const noexcept {
  return {.V = static_cast<double>(V_[i]),
          .gates = {.n = static_cast<double>(n_[i]),
                    .m = static_cast<double>(m_[i]),
                    .h = static_cast<double>(h_[i])}};
}

template <class Real>
void HodgkinHuxleyArrays<Real>::set_state(std::size_t i,
                                          const RestingStates::State& state) noexcept {
  for (AlignedArray<Real>& past : history_memory_) {
    if (past.size() > 0) past[i] = Real(0);
  }
  V_[i] = static_cast<Real>(state.V);
  n_[i] = static_cast<Real>(state.gates.n);
  m_[i] = static_cast<Real>(state.gates.m);
  h_[i] = static_cast<Real>(state.gates.h);
  for (Real* const seen : arguments_.coupling.seen) {
    if (seen != nullptr) seen[i] = V_[i];
  }
}

template <class Real>
double HodgkinHuxleyArrays<Real>::exchange(std::size_t i,
                                           std::uint64_t steps_taken) const noexcept {
  if (outflow_.size() == 0) return 0.0;
  const CouplingArguments<Real>& coupling = arguments_.coupling;
  const Real* const V = coupling.seen[seen_after(steps_taken)] + i;
  return static_cast<double>(from_previous_column_[i] * V[-1] + from_next_column_[i] * V[1] +
                             from_previous_row_[i] * V[-coupling.columns] +
                             from_next_row_[i] * V[coupling.columns] - outflow_[i] * V_[i]);
}

template class HodgkinHuxleyArrays<double>;
template class HodgkinHuxleyArrays<float>;

}  // namespace merkel
