// One-step methods: Crank–Nicolson, Rush–Larsen, exponential and backward Euler.
#include "core/neurons/hodgkin_huxley/kernel/hodgkin_huxley_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/hodgkin_huxley/kernel/one_step.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/hodgkin_huxley/kernel/stepping-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// Reports spikes and non-finite states of `count` neurons from i on, and resets non-finite states.
template <class Real>
HWY_NOINLINE void observe_one_step(const HodgkinHuxleyArguments<Real>& a, std::size_t i,
                                   std::size_t count, int step, const Real* before,
                                   const Real* after) {
  const NeuronConstants<Real>& c = *a.constants;
  observe_step(
      a.call, step, i, count, c.threshold, before, after,
      [&](std::size_t lane) {
        return linear_crossing(static_cast<double>(before[lane]), static_cast<double>(after[lane]),
                               c.threshold_mV);
      },
      [&](std::size_t neuron) { reset_neuron(a, neuron); });
}

/// The arithmetic of a step of the neurons [i, i + kCount·lanes), in pieces. kFast: the shared
/// exponential and Crank–Nicolson for gates and potential, with two divisions.
template <bool kFast, bool kCoupled, int kCount, class D>
struct OneStepPieces {
  using Math = SideBySide<D, kCount>;
  using Neurons = RightHandSide<D, kCount>;
  using Real = hn::TFromD<D>;
  using X = VectorPack<D, kCount>;
  using Arguments = HodgkinHuxleyArguments<Real>;
  using Constants = VectorConstants<D>;

  static HWY_INLINE GateSteps<X> gate_steps(const Arguments& a, const Constants& c, std::size_t i,
                                            int, const RateFractions<X>& rates) {
    return Neurons::gate_steps(rates, Neurons::load_gates(a, i), c.half);
  }
  /// Steps the gates by the given fractions.
  static HWY_INLINE void take(const Arguments& a, const Constants& c, std::size_t i, int,
                              const GateSteps<X>& steps) {
    const GateValues<X> x = Neurons::load_gates(a, i);
    Neurons::store_gates(taken(steps, x, c), a, i);
  }
  static HWY_INLINE GateValues<X> taken(const GateSteps<X>& steps, const GateValues<X>& x,
                                        const Constants& c) {
    const GateValues<X> inverse = Neurons::inverses(steps.denominator, c.one);
    return {.n = Math::fused(steps.change.n, inverse.n, x.n),
            .m = Math::fused(steps.change.m, inverse.m, x.m),
            .h = Math::fused(steps.change.h, inverse.h, x.h)};
  }

  /// The gates after the step.
  static HWY_INLINE GateValues<X> new_gates(const Arguments& a, const Constants& c,
                                            const X& potential, const GateValues<X>& old) {
    if constexpr (kFast) {
      const auto rates = Neurons::template rates<true>(potential, c, *a.constants);
      return taken(Neurons::gate_steps(rates, old, c.half), old, c);
    } else {
      const RateFractions<X> r = Neurons::rates(potential, c, *a.constants);
      const auto step = [&](const Fraction<X>& rate, const X& x) HWY_ATTR {
        const X change = Math::fused_negative(rate.s, x, rate.p);
        if (a.gate_rule == GateRule::kCrankNicolson) {
          return Math::add(x, Math::div(change, Math::fused(rate.s, c.half, rate.D)));
        }
        const X decay = Math::exponential(Math::neg(Math::div(rate.s, rate.D)));
        const X toward = Math::div(change, rate.s);
        return Math::fused_negative(toward, decay, Math::add(x, toward));
      };
      return {.n = step(r.n, old.n), .m = step(r.m, old.m), .h = step(r.h, old.h)};
    }
  }

  /// Steps the potential with the given gates, reports spikes and publishes the potential to the
  /// neighbours.
  static HWY_INLINE void step_potential(const Arguments& a, const Constants& c, std::size_t i,
                                        int step, hn::Vec<D> phase, int seen,
                                        const GateValues<X>& gates) {
    const D d;
    const X before = Math::load(a.V + i);
    const Channels<X> open =
        Neurons::template driven_channels<kCoupled>(a, c, i, phase, seen, gates);
    X conductance = open.conductance;
    X implicit = Math::fused(conductance, c.half, c.capacitance_per_step);
    if constexpr (kCoupled) {
      const X outflow = Math::load(a.coupling.outflow + i);
      conductance = Math::add(conductance, outflow);
      implicit = Math::fused(outflow, hn::Set(d, a.coupling.outflow_implicitness), implicit);
    }

    X after;
    const X imbalance = Math::fused_negative(conductance, before, open.driven);
    if (kFast || a.voltage_rule == VoltageRule::kCrankNicolson) {
      after = Math::add(before, Math::div(imbalance, implicit));
    } else if (a.voltage_rule == VoltageRule::kBackwardEuler) {
      after =
          Math::add(before, Math::div(imbalance, Math::add(conductance, c.capacitance_per_step)));
    } else {
      const X toward = Math::div(imbalance, conductance);
      const X decay = Math::exponential(Math::neg(Math::div(conductance, c.capacitance_per_step)));
      after = Math::fused_negative(toward, decay, Math::add(before, toward));
    }

    Math::store(after, a.V + i);
    auto rare = Math::rises(before, after, c.threshold);
    // Without a network, a non-finite state affects only its own neuron: one check per call is
    // enough.
    if constexpr (kCoupled) {
      const auto sane = Math::less(Math::abs(after), Math::constant(kRunaway_mV));
      rare = Math::either(rare, Math::inverse(sane));
    }
    if (HWY_UNLIKELY(Math::any(rare))) {
      HWY_ALIGN Real from[kCount * hn::MaxLanes(d)];
      HWY_ALIGN Real to[kCount * hn::MaxLanes(d)];
      Math::store(before, from);
      Math::store(after, to);
      observe_one_step(a, i, kCount * hn::Lanes(d), step, from, to);
      after = Math::load(a.V + i);
    }
    if constexpr (kCoupled) {
      Math::store(Math::fused(Math::sub(after, before), hn::Set(d, a.coupling.lookahead), after),
                  a.coupling.seen[1 - seen] + i);
    }
  }

  /// The whole step at once.
  static HWY_INLINE void step_all(const Arguments& a, const Constants& c, std::size_t i, int step,
                                  hn::Vec<D> phase, int seen) {
    const GateValues<X> old = Neurons::load_gates(a, i);
    const GateValues<X> gates = new_gates(a, c, Math::load(a.V + i), old);
    Neurons::store_gates(gates, a, i);
    step_potential(a, c, i, step, phase, seen, !kFast && a.old_gates ? old : gates);
  }
};

template <bool kFast, bool kIsCoupled, class D>
struct OneStep {
  static constexpr bool kShared = kFast;
  static constexpr bool kCoupled = kIsCoupled;
  template <int kCount>
  using Pieces = OneStepPieces<kFast, kCoupled, kCount, D>;
  static constexpr auto& kObserve = observe_one_step<hn::TFromD<D>>;
};

template <class Real>
HWY_INLINE void step_all(const HodgkinHuxleyArguments<Real>& a) {
  using D = hn::ScalableTag<Real>;
  const bool fast = a.constants->shared_exponential && !a.old_gates &&
                    a.gate_rule == GateRule::kCrankNicolson &&
                    a.voltage_rule == VoltageRule::kCrankNicolson;
  if (a.coupling.outflow != nullptr) {
    fast ? take_steps<OneStep<true, true, D>>(D(), a) : take_steps<OneStep<false, true, D>>(D(), a);
  } else {
    fast ? take_steps<OneStep<true, false, D>>(D(), a)
         : take_steps<OneStep<false, false, D>>(D(), a);
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
