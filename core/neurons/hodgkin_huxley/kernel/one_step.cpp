// One-step methods: Crank–Nicolson, Rush–Larsen, exponential and backward Euler.
#include <algorithm>
#include <cmath>

#include "core/neurons/hodgkin_huxley/kernel/hodgkin_huxley_kernel.hpp"
#include "core/neurons/neuron_arrays.hpp"
#include "core/neurons/spike_detector.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/hodgkin_huxley/kernel/one_step.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/hodgkin_huxley/kernel/rates-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// Puts a neuron whose state turned non-finite at rest.
template <class Real>
void put_to_rest(const HodgkinHuxleyArguments<Real>& a, std::size_t neuron) {
  const NeuronConstants<Real>& c = *a.constants;
  a.V[neuron] = c.V_rest;
  a.n[neuron] = c.rest_n;
  a.m[neuron] = c.rest_m;
  a.h[neuron] = c.rest_h;
}

/// Reports the spikes and non-finite states of `count` neurons from i on, and resets the latter.
template <class Real>
HWY_NOINLINE void observe(const HodgkinHuxleyArguments<Real>& a, std::size_t i, std::size_t count,
                          int step, const Real* before, const Real* after) {
  const NeuronConstants<Real>& c = *a.constants;
  observe_step(
      a.call, step, i, count, c.threshold, before, after,
      [&](std::size_t lane) {
        return linear_crossing(static_cast<double>(before[lane]), static_cast<double>(after[lane]),
                               c.threshold_mV);
      },
      [&](std::size_t neuron) { put_to_rest(a, neuron); });
}

/// The neurons [i, i + kCount·lanes) through one step. kFast: the shared exponential and
/// Crank–Nicolson for gates and potential, by two divisions.
template <bool kFast, bool kCoupled, int kCount, class D>
HWY_INLINE void step_some(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& a,
                          const VectorConstants<D>& c, std::size_t i, int step, hn::Vec<D> phase,
                          int seen) {
  using Math = SideBySide<D, kCount>;
  using Neurons = RightHandSide<D, kCount>;
  using Real = hn::TFromD<D>;
  using X = VectorPack<D, kCount>;
  const X before = Math::load(a.V + i);
  const X old_n = Math::load(a.n + i);
  const X old_m = Math::load(a.m + i);
  const X old_h = Math::load(a.h + i);
  X n;
  X m;
  X h;
  if constexpr (kFast) {
    const RateFractions<X> r = Neurons::shared_rates(before, c);
    X inverse_n;
    X inverse_m;
    X inverse_h;
    Neurons::three_inverses(Math::fused(r.n.s, c.half, r.n.D), Math::fused(r.m.s, c.half, r.m.D),
                            Math::fused(r.h.s, c.half, r.h.D), c.one, inverse_n, inverse_m,
                            inverse_h);
    n = Math::fused(Math::fused_negative(r.n.s, old_n, r.n.p), inverse_n, old_n);
    m = Math::fused(Math::fused_negative(r.m.s, old_m, r.m.p), inverse_m, old_m);
    h = Math::fused(Math::fused_negative(r.h.s, old_h, r.h.p), inverse_h, old_h);
  } else {
    const RateFractions<X> r = a.constants->shared_exponential
                                   ? Neurons::shared_rates(before, c)
                                   : Neurons::general_rates(before, *a.constants);
    const auto go_on = [&](const Fraction<X>& rate, const X& x) HWY_ATTR {
      const X change = Math::fused_negative(rate.s, x, rate.p);
      if (a.gate_rule == GateRule::kCrankNicolson) {
        return Math::add(x, Math::div(change, Math::fused(rate.s, c.half, rate.D)));
      }
      const X decay = Math::exponential(Math::neg(Math::div(rate.s, rate.D)));
      const X toward = Math::div(change, rate.s);
      return Math::fused_negative(toward, decay, Math::add(x, toward));
    };
    n = go_on(r.n, old_n);
    m = go_on(r.m, old_m);
    h = go_on(r.h, old_h);
  }

  const bool old_gates = !kFast && a.old_gates;
  const Channels<X> open =
      old_gates ? Neurons::channels(old_n, old_m, old_h, c) : Neurons::channels(n, m, h, c);
  X driven = Math::add(open.driven, Math::fused(Math::load(a.input_change + i), phase,
                                                Math::load(a.input_begin + i)));
  X conductance = open.conductance;
  X implicit = Math::fused(conductance, c.half, c.capacitance_per_step);
  if constexpr (kCoupled) {
    const X outflow = Math::load(a.coupling.outflow + i);
    driven = Neurons::add_inflow(a.coupling, seen, i, driven);
    conductance = Math::add(conductance, outflow);
    implicit = Math::fused(outflow, hn::Set(d, a.coupling.outflow_implicitness), implicit);
  }

  X after;
  const X imbalance = Math::fused_negative(conductance, before, driven);
  if (kFast || a.voltage_rule == VoltageRule::kCrankNicolson) {
    after = Math::add(before, Math::div(imbalance, implicit));
  } else if (a.voltage_rule == VoltageRule::kBackwardEuler) {
    after = Math::add(before, Math::div(imbalance, Math::add(conductance, c.capacitance_per_step)));
  } else {
    const X toward = Math::div(imbalance, conductance);
    const X decay = Math::exponential(Math::neg(Math::div(conductance, c.capacitance_per_step)));
    after = Math::fused_negative(toward, decay, Math::add(before, toward));
  }

  Math::store(after, a.V + i);
  Math::store(n, a.n + i);
  Math::store(m, a.m + i);
  Math::store(h, a.h + i);
  auto rare = Math::rises(before, after, c.threshold);
  // Without a network a non-finite state affects its own neuron only: one look a call is enough.
  if constexpr (kCoupled) {
    const auto sane = Math::less(Math::abs(after), Math::constant(kRunaway_mV));
    rare = Math::either(rare, Math::inverse(sane));
  }
  if (HWY_UNLIKELY(Math::any(rare))) {
    HWY_ALIGN Real from[kCount * hn::MaxLanes(d)];
    HWY_ALIGN Real to[kCount * hn::MaxLanes(d)];
    Math::store(before, from);
    Math::store(after, to);
    observe(a, i, kCount * hn::Lanes(d), step, from, to);
    after = Math::load(a.V + i);
  }
  if constexpr (kCoupled) {
    Math::store(Math::fused(Math::sub(after, before), hn::Set(d, a.coupling.lookahead), after),
                a.coupling.seen[1 - seen] + i);
  }
}

/// The share of all steps at whose point the current is taken in a step.
template <class D>
HWY_INLINE hn::Vec<D> phase_of(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& a, int step) {
  return hn::Set(d, (static_cast<hn::TFromD<D>>(step) + a.input_phase) /
                        static_cast<hn::TFromD<D>>(a.call.steps));
}

/// The neurons [begin, end) through one step, several vectors at a time.
template <bool kFast, bool kCoupled, class D>
HWY_INLINE void step_range(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& a,
                           const VectorConstants<D>& c, std::size_t begin, std::size_t end,
                           int step, int seen) {
  constexpr int kCount = kFast ? 2 : 1;
  const auto phase = phase_of(d, a, step);
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = begin;
  for (; i + (kCount - 1) * lanes < end; i += kCount * lanes) {
    step_some<kFast, kCoupled, kCount>(d, a, c, i, step, phase, seen);
  }
  for (; i < end; i += lanes) step_some<kFast, kCoupled, 1>(d, a, c, i, step, phase, seen);
}

/// Without a network: a few blocks at a time through all steps, which stay in the nearest cache.
template <bool kFast, class D>
HWY_INLINE void step_alone(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& arguments) {
  constexpr std::size_t kChunk = 4 * kNeuronBlock;
  const HodgkinHuxleyArguments<hn::TFromD<D>> a = arguments;  // a local copy: nothing aliases it
  const VectorConstants<D> c(*a.constants);
  std::size_t begin = a.call.first;
  while (begin < a.call.last) {
    if (a.frozen != nullptr && a.frozen[begin / kNeuronBlock] != 0) {
      begin += kNeuronBlock;
      continue;
    }
    std::size_t end = std::min(begin + kNeuronBlock, a.call.last);
    while (end < a.call.last && end - begin < kChunk &&
           (a.frozen == nullptr || a.frozen[end / kNeuronBlock] == 0)) {
      end = std::min(end + kNeuronBlock, a.call.last);
    }
    for (int step = 0; step < a.call.steps; ++step) {
      step_range<kFast, false>(d, a, c, begin, end, step, 0);
    }
    for (std::size_t i = begin; i < end; ++i) {
      if (HWY_UNLIKELY(!(std::fabs(a.V[i]) < static_cast<hn::TFromD<D>>(kRunaway_mV)))) {
        observe(a, i, 1, a.call.steps - 1, a.V + i, a.V + i);
      }
    }
    begin = end;
  }
}

/// With a network: all neurons through one step, then the next.
template <bool kFast, class D>
HWY_INLINE void step_coupled(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& arguments) {
  const HodgkinHuxleyArguments<hn::TFromD<D>> a = arguments;
  const VectorConstants<D> c(*a.constants);
  int seen = a.seen_at_begin;
  for (int step = 0; step < a.call.steps; ++step) {
    if (a.frozen == nullptr) {
      step_range<kFast, true>(d, a, c, a.call.first, a.call.last, step, seen);
    } else {
      for (std::size_t block = a.call.first; block < a.call.last; block += kNeuronBlock) {
        if (a.frozen[block / kNeuronBlock] != 0) continue;
        step_range<kFast, true>(d, a, c, block, std::min(block + kNeuronBlock, a.call.last), step,
                                seen);
      }
    }
    seen = 1 - seen;
    if (a.call.peers != nullptr) a.call.peers->barrier();
  }
}

template <class Real>
HWY_INLINE void step_all(const HodgkinHuxleyArguments<Real>& a) {
  const hn::ScalableTag<Real> d;
  const bool fast = a.constants->shared_exponential && !a.old_gates &&
                    a.gate_rule == GateRule::kCrankNicolson &&
                    a.voltage_rule == VoltageRule::kCrankNicolson;
  if (a.coupling.outflow != nullptr) {
    fast ? step_coupled<true>(d, a) : step_coupled<false>(d, a);
  } else {
    fast ? step_alone<true>(d, a) : step_alone<false>(d, a);
  }
}

void one_step_double(const HodgkinHuxleyArguments<double>& arguments) { step_all(arguments); }
void one_step_float(const HodgkinHuxleyArguments<float>& arguments) { step_all(arguments); }

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(one_step_double);
HWY_EXPORT(one_step_float);

void step_hodgkin_huxley(const HodgkinHuxleyArguments<double>& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(one_step_double)(arguments);
}

void step_hodgkin_huxley(const HodgkinHuxleyArguments<float>& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(one_step_float)(arguments);
}

}  // namespace merkel
#endif
