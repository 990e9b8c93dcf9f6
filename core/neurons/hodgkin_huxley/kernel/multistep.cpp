// The staggered multistep method of fourth order.
// As in staggered Crank–Nicolson, gates and potential are half a step apart, and each sees the
// other in the middle of its step.
// There every equation is linear, ẋ = (p − s·x)/D. With f = ẋ·dt in the middle
// of a step, f' and f'' from differences of its last values,
//   x₊ = x₋ + f + f''/24,   x in the middle = (x₊ + x₋)/2 − f'/8,
// which gives one equation for f. The two terms, which Crank–Nicolson lacks, raise the order to
// four at the same single rate evaluation. After Ghrist, Fornberg and Driscoll, Staggered time
// integrators for wave equations, SIAM J. Numer. Anal. 38 (2000).
#include "core/neurons/hodgkin_huxley/kernel/hodgkin_huxley_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/hodgkin_huxley/kernel/multistep.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/hodgkin_huxley/kernel/stepping-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// f of the last three steps of one variable. f of the current step replaces the oldest.
template <class D, int kCount>
struct DerivativeHistory {
  using Real = hn::TFromD<D>;
  using Math = SideBySide<D, kCount>;
  using X = VectorPack<D, kCount>;

  /// The coefficient of f in x in the middle of the step: 13/24 − 3/16.
  static constexpr double kImplicit = 17.0 / 48;

  HWY_INLINE DerivativeHistory(const HodgkinHuxleyArguments<Real>& a, int variable, std::size_t i,
                               int step) {
    const auto number = a.call.steps_before + static_cast<std::uint64_t>(step);
    oldest = a.history->of(variable, number) + i;
    f1 = Math::load(a.history->of(variable, number + 2) + i);
    f2 = Math::load(a.history->of(variable, number + 1) + i);
    f3 = Math::load(oldest);
  }

  /// x in the middle of the step, without kImplicit·f.
  HWY_INLINE X middle(const X& x) const {
    return Math::add(x, Math::fused(f1, Math::constant(7.0 / 48),
                                    Math::mul(Math::sub(f2, f3), Math::constant(1.0 / 48))));
  }
  /// x after the step. Stores f.
  HWY_INLINE X after(const X& x, const X& f) const {
    Math::store(f, oldest);
    const X past = Math::fused(
        f1, Math::constant(-5.0 / 24),
        Math::fused(f2, Math::constant(4.0 / 24), Math::mul(f3, Math::constant(-1.0 / 24))));
    return Math::add(x, Math::fused(f, Math::constant(26.0 / 24), past));
  }
  /// x half a step after `x`, extrapolated.
  HWY_INLINE X ahead(const X& x, const X& f) const {
    return Math::add(x, Math::fused(f, Math::constant(29.0 / 24),
                                    Math::fused(f1, Math::constant(-25.0 / 24),
                                                Math::mul(f2, Math::constant(8.0 / 24)))));
  }

  X f1;
  X f2;
  X f3;
  Real* oldest;
};

/// Reports spikes and non-finite states of `count` neurons from i on, and resets non-finite states.
/// A spike occurs where the cubic through both potentials with the slopes f and f1 reaches the
/// threshold.
template <class Real>
HWY_NOINLINE void observe_multistep(const HodgkinHuxleyArguments<Real>& a, std::size_t i,
                                    std::size_t count, int step, const Real* before,
                                    const Real* after) {
  const NeuronConstants<Real>& c = *a.constants;
  const auto number = a.call.steps_before + static_cast<std::uint64_t>(step);
  const auto crossing = [&](std::size_t lane) {
    const auto from = static_cast<double>(before[lane]);
    const auto to = static_cast<double>(after[lane]);
    const auto f = static_cast<double>(a.history->of(0, number)[i + lane]);
    const auto f1 = static_cast<double>(a.history->of(0, number + 2)[i + lane]);
    const double cubic = 4.0 * (to - from - f);
    const double square = 0.5 * (f - f1);
    const double slope = to - from - square - cubic;
    return hermite_crossing(from, slope, to, slope + 2.0 * square + 3.0 * cubic, c.threshold_mV);
  };
  observe_step(a.call, step, i, count, c.threshold, before, after, crossing,
               [&](std::size_t neuron) { reset_neuron(a, neuron); });
}

template <bool kIsShared, bool kIsCoupled, class D>
struct Multistep {
  using Real = hn::TFromD<D>;
  using Arguments = HodgkinHuxleyArguments<Real>;
  using Constants = VectorConstants<D>;
  static constexpr bool kShared = kIsShared;
  static constexpr bool kCoupled = kIsCoupled;
  static constexpr auto& kObserve = observe_multistep<Real>;

  template <int kCount>
  struct Pieces {
    using Math = SideBySide<D, kCount>;
    using Neurons = RightHandSide<D, kCount>;
    using X = VectorPack<D, kCount>;
    using History = DerivativeHistory<D, kCount>;

    static HWY_INLINE GateSteps<X> gate_steps(const Arguments& a, const Constants&, std::size_t i,
                                              int step, const RateFractions<X>& rates) {
      const GateValues<X> middle{.n = History(a, 1, i, step).middle(Math::load(a.n + i)),
                                 .m = History(a, 2, i, step).middle(Math::load(a.m + i)),
                                 .h = History(a, 3, i, step).middle(Math::load(a.h + i))};
      return Neurons::gate_steps(rates, middle, Math::constant(History::kImplicit));
    }
    static HWY_INLINE void take(const Arguments& a, const Constants& c, std::size_t i, int step,
                                const GateSteps<X>& steps) {
      const GateValues<X> inverse = Neurons::inverses(steps.denominator, c.one);
      const auto after = [&](int variable, Real* x, const X& change,
                             const X& over) MERKEL_INLINE_LAMBDA {
        Math::store(History(a, variable, i, step).after(Math::load(x + i), Math::mul(change, over)),
                    x + i);
      };
      after(1, a.n, steps.change.n, inverse.n);
      after(2, a.m, steps.change.m, inverse.m);
      after(3, a.h, steps.change.h, inverse.h);
    }

    static HWY_INLINE void step_potential(const Arguments& a, const Constants& c, std::size_t i,
                                          int step, hn::Vec<D> phase, int seen,
                                          const GateValues<X>& gates) {
      const D d;
      const History past(a, 0, i, step);
      const X before = Math::load(a.V + i);
      Channels<X> open = Neurons::template driven_channels<kCoupled>(a, c, i, phase, seen, gates);
      if constexpr (kCoupled) {
        open.conductance = Math::add(open.conductance, Math::load(a.coupling.outflow + i));
      }
      const X imbalance = Math::fused_negative(open.conductance, past.middle(before), open.driven);
      const X f =
          Math::div(imbalance, Math::fused(open.conductance, Math::constant(History::kImplicit),
                                           c.capacitance_per_step));
      X after = past.after(before, f);
      Math::store(after, a.V + i);
      auto rare = Math::rises(before, after, c.threshold);
      if constexpr (kCoupled) {
        Math::store(past.ahead(after, f), a.coupling.seen[1 - seen] + i);
        const auto sane = Math::less(Math::abs(after), Math::constant(kRunaway_mV));
        rare = Math::either(rare, Math::inverse(sane));
      }
      if (HWY_LIKELY(!Math::any(rare))) return;
      HWY_ALIGN Real from[kCount * hn::MaxLanes(d)];
      HWY_ALIGN Real to[kCount * hn::MaxLanes(d)];
      Math::store(before, from);
      Math::store(after, to);
      kObserve(a, i, kCount * hn::Lanes(d), step, from, to);
      if constexpr (kCoupled) {
        // The neighbours see reset neurons at rest.
        for (std::size_t lane = 0; lane < kCount * hn::Lanes(d); ++lane) {
          if (!(std::fabs(to[lane]) < static_cast<Real>(kRunaway_mV))) {
            a.coupling.seen[1 - seen][i + lane] = a.V[i + lane];
          }
        }
      }
    }

    static HWY_INLINE void step_all(const Arguments& a, const Constants& c, std::size_t i, int step,
                                    hn::Vec<D> phase, int seen) {
      const X V = Math::load(a.V + i);
      take(a, c, i, step,
           gate_steps(a, c, i, step, Neurons::template rates<kShared>(V, c, *a.constants)));
      step_potential(a, c, i, step, phase, seen, Neurons::load_gates(a, i));
    }
  };
};

template <class Real>
HWY_INLINE void take_multisteps(const HodgkinHuxleyArguments<Real>& a) {
  using D = hn::ScalableTag<Real>;
  const bool shared = a.constants->shared_exponential;
  if (a.coupling.outflow != nullptr) {
    shared ? take_steps<Multistep<true, true, D>>(D(), a)
           : take_steps<Multistep<false, true, D>>(D(), a);
  } else {
    shared ? take_steps<Multistep<true, false, D>>(D(), a)
           : take_steps<Multistep<false, false, D>>(D(), a);
  }
}

void multistep_double(const HodgkinHuxleyArguments<double>& arguments) {
  take_multisteps(arguments);
}
void multistep_float(const HodgkinHuxleyArguments<float>& arguments) { take_multisteps(arguments); }

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(multistep_double);
HWY_EXPORT(multistep_float);

void step_multistep(const HodgkinHuxleyArguments<double>& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(multistep_double)(arguments);
}

void step_multistep(const HodgkinHuxleyArguments<float>& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(multistep_float)(arguments);
}

}  // namespace merkel
#endif
