// One-step methods: Crank–Nicolson, Rush–Larsen, exponential and backward Euler.
#include <algorithm>
#include <cmath>
#include <type_traits>

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

/// The arithmetic of a step of the neurons [i, i + kCount·lanes), in pieces. kFast: the shared
/// exponential and Crank–Nicolson for gates and potential, by two divisions.
template <bool kFast, bool kCoupled, int kCount, class D>
struct StepPieces {
  using Math = SideBySide<D, kCount>;
  using Neurons = RightHandSide<D, kCount>;
  using Real = hn::TFromD<D>;
  using X = VectorPack<D, kCount>;
  using Arguments = HodgkinHuxleyArguments<Real>;
  using Constants = VectorConstants<D>;

  static HWY_INLINE GateValues<X> load_gates(const Arguments& a, std::size_t i) {
    return {.n = Math::load(a.n + i), .m = Math::load(a.m + i), .h = Math::load(a.h + i)};
  }
  static HWY_INLINE void store_gates(const GateValues<X>& gates, const Arguments& a,
                                     std::size_t i) {
    Math::store(gates.n, a.n + i);
    Math::store(gates.m, a.m + i);
    Math::store(gates.h, a.h + i);
  }

  /// Steps the gates by the given fractions.
  static HWY_INLINE void take(const Arguments& a, const Constants& c, std::size_t i,
                              const GateSteps<X>& steps) {
    store_gates(Neurons::take(steps, load_gates(a, i), c), a, i);
  }

  /// The gates after the step.
  static HWY_INLINE GateValues<X> new_gates(const Arguments& a, const Constants& c,
                                            const X& potential, const GateValues<X>& old) {
    if constexpr (kFast) {
      const auto rates = Neurons::shared_rates(Neurons::shared_exponential(potential, c), c);
      return Neurons::take(Neurons::crank_nicolson(rates, old, c), old, c);
    } else {
      const RateFractions<X> r =
          a.constants->shared_exponential
              ? Neurons::shared_rates(Neurons::shared_exponential(potential, c), c)
              : Neurons::general_rates(potential, *a.constants);
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

  /// Steps the potential with the given gates, reports spikes and publishes to the neighbours.
  static HWY_INLINE void step_potential(const Arguments& a, const Constants& c, std::size_t i,
                                        int step, hn::Vec<D> phase, int seen,
                                        const GateValues<X>& gates) {
    const D d;
    const X before = Math::load(a.V + i);
    const Channels<X> open = Neurons::channels(gates, c);
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
      after =
          Math::add(before, Math::div(imbalance, Math::add(conductance, c.capacitance_per_step)));
    } else {
      const X toward = Math::div(imbalance, conductance);
      const X decay = Math::exponential(Math::neg(Math::div(conductance, c.capacitance_per_step)));
      after = Math::fused_negative(toward, decay, Math::add(before, toward));
    }

    Math::store(after, a.V + i);
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

  /// The whole step at once.
  static HWY_INLINE void step_all(const Arguments& a, const Constants& c, std::size_t i, int step,
                                  hn::Vec<D> phase, int seen) {
    const GateValues<X> old = load_gates(a, i);
    const GateValues<X> gates = new_gates(a, c, Math::load(a.V + i), old);
    store_gates(gates, a, i);
    step_potential(a, c, i, step, phase, seen, !kFast && a.old_gates ? old : gates);
  }
};

/// So many vectors at a time.
template <int kCount>
using Vectors = std::integral_constant<int, kCount>;

/// Calls work(Vectors<kMost>(), i) for i in [begin, end), and at the end one vector at a time.
template <int kMost, class D, class Work>
HWY_INLINE void for_each_pack(D d, std::size_t begin, std::size_t end, const Work& work) {
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = begin;
  for (; i + (kMost - 1) * lanes < end; i += kMost * lanes) work(Vectors<kMost>(), i);
  for (; i < end; i += lanes) work(Vectors<1>(), i);
}

/// The share of all steps at whose point the current is taken in a step.
template <class D>
HWY_INLINE hn::Vec<D> phase_of(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& a, int step) {
  return hn::Set(d, (static_cast<hn::TFromD<D>>(step) + a.input_phase) /
                        static_cast<hn::TFromD<D>>(a.call.steps));
}

/// Neurons that go through the stages of a step together. Their data stays in the nearest cache.
constexpr std::size_t kStaged = 8 * kNeuronBlock;

/// The fast step in stages, each a loop over a block of neurons. The whole step is one chain of
/// dependent operations that is longer than a processor looks ahead; in a stage several vectors
/// overlap. Each neuron sees the same operations as in StepPieces::step_all.
template <bool kCoupled, class D>
class StagedStep {
 public:
  using Real = hn::TFromD<D>;
  using Arguments = HodgkinHuxleyArguments<Real>;
  using Constants = VectorConstants<D>;

  /// Vectors of 64 bytes need less overlap: in double precision the gates' two stages are one, in
  /// single precision the whole step is.
  static constexpr bool kWide = hn::MaxLanes(D()) * sizeof(Real) >= 64;
  static constexpr bool kPays = !kWide || sizeof(Real) == 8;

  /// Neurons [begin, end), at most kStaged.
  static HWY_INLINE void take(const Arguments& a, const Constants& c, std::size_t begin,
                              std::size_t end, int step, int seen) {
    Memory memory;
    find_exponentials(a, c, begin, end, memory);
    if constexpr (kWide) {
      step_gates(a, c, begin, end, memory);
    } else {
      find_gate_steps(a, c, begin, end, memory);
      take_gate_steps(a, c, begin, end, memory);
    }
    step_potentials(a, c, begin, end, step, seen);
  }

 private:
  template <int kCount>
  using Pieces = StepPieces<true, kCoupled, kCount, D>;
  template <int kCount>
  using Math = SideBySide<D, kCount>;
  template <int kCount>
  using Neurons = RightHandSide<D, kCount>;
  template <int kCount>
  using Gates = GateValues<VectorPack<D, kCount>>;
  template <int kCount>
  using Steps = GateSteps<VectorPack<D, kCount>>;

  using ForGates = Real[3][kStaged];
  /// What the stages pass on, by neuron of the block.
  struct Memory {
    HWY_ALIGN Real w[kStaged];
    HWY_ALIGN Real b[kStaged];
    HWY_ALIGN ForGates change;
    HWY_ALIGN ForGates denominator;
  };
  template <int kCount>
  static HWY_INLINE void store(const Gates<kCount>& x, ForGates& to, std::size_t k) {
    Math<kCount>::store(x.n, to[0] + k);
    Math<kCount>::store(x.m, to[1] + k);
    Math<kCount>::store(x.h, to[2] + k);
  }
  template <int kCount>
  static HWY_INLINE Gates<kCount> load(const ForGates& from, std::size_t k) {
    return {.n = Math<kCount>::load(from[0] + k),
            .m = Math<kCount>::load(from[1] + k),
            .h = Math<kCount>::load(from[2] + k)};
  }
  /// The rates, and the gates' steps as fractions, of the neurons from i on.
  template <int kCount>
  static HWY_INLINE Steps<kCount> gate_steps(const Arguments& a, const Constants& c, std::size_t i,
                                             const Memory& memory, std::size_t k) {
    return Neurons<kCount>::crank_nicolson(
        Neurons<kCount>::shared_rates(
            {.w = Math<kCount>::load(memory.w + k), .b = Math<kCount>::load(memory.b + k)}, c),
        Pieces<kCount>::load_gates(a, i), c);
  }

  static HWY_NOINLINE void find_exponentials(const Arguments& arguments, const Constants& c,
                                             std::size_t begin, std::size_t end, Memory& memory) {
    const Arguments a = arguments;  // a local copy, here and below: nothing aliases it
    for_each_pack<4>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      const auto found = Neurons<count>::shared_exponential(Math<count>::load(a.V + i), c);
      Math<count>::store(found.w, memory.w + (i - begin));
      Math<count>::store(found.b, memory.b + (i - begin));
    });
  }
  static HWY_NOINLINE void find_gate_steps(const Arguments& arguments, const Constants& c,
                                           std::size_t begin, std::size_t end, Memory& memory) {
    const Arguments a = arguments;
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      const Steps<count> steps = gate_steps<count>(a, c, i, memory, i - begin);
      store<count>(steps.denominator, memory.denominator, i - begin);
      store<count>(steps.change, memory.change, i - begin);
    });
  }
  /// The division, and the gates after the step.
  static HWY_NOINLINE void take_gate_steps(const Arguments& arguments, const Constants& c,
                                           std::size_t begin, std::size_t end,
                                           const Memory& memory) {
    const Arguments a = arguments;
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      Pieces<count>::take(a, c, i,
                          {.change = load<count>(memory.change, i - begin),
                           .denominator = load<count>(memory.denominator, i - begin)});
    });
  }
  /// Both in one stage.
  static HWY_NOINLINE void step_gates(const Arguments& arguments, const Constants& c,
                                      std::size_t begin, std::size_t end, const Memory& memory) {
    const Arguments a = arguments;
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      Pieces<count>::take(a, c, i, gate_steps<count>(a, c, i, memory, i - begin));
    });
  }
  static HWY_NOINLINE void step_potentials(const Arguments& a, const Constants& c,
                                           std::size_t begin, std::size_t end, int step, int seen) {
    const auto phase = phase_of(D(), a, step);
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      Pieces<count>::step_potential(a, c, i, step, phase, seen, Pieces<count>::load_gates(a, i));
    });
  }
};

/// Neurons [begin, end) through one step.
template <bool kFast, bool kCoupled, class D>
HWY_INLINE void step_range(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& a,
                           const VectorConstants<D>& c, std::size_t begin, std::size_t end,
                           int step, int seen) {
  if constexpr (kFast && StagedStep<kCoupled, D>::kPays) {
    StagedStep<kCoupled, D>::take(a, c, begin, end, step, seen);
  } else {
    const auto phase = phase_of(d, a, step);
    for_each_pack<kFast ? 2 : 1>(
        d, begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
          StepPieces<kFast, kCoupled, count, D>::step_all(a, c, i, step, phase, seen);
        });
  }
}

/// Calls work(begin, end) for each run of blocks that are not frozen, at most kStaged neurons at a
/// time.
template <class Real, class Work>
HWY_INLINE void for_each_run(const HodgkinHuxleyArguments<Real>& a, const Work& work) {
  const auto frozen = [&](std::size_t i) MERKEL_INLINE_LAMBDA {
    return a.frozen != nullptr && a.frozen[i / kNeuronBlock] != 0;
  };
  std::size_t begin = a.call.first;
  while (begin < a.call.last) {
    std::size_t end = begin;
    while (end < a.call.last && end - begin < kStaged && !frozen(end)) {
      end = std::min(end + kNeuronBlock, a.call.last);
    }
    if (begin < end) work(begin, end);
    begin = begin < end ? end : begin + kNeuronBlock;
  }
}

/// Without a network: a few blocks at a time through all steps, which stay in the nearest cache.
template <bool kFast, class D>
HWY_INLINE void step_alone(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& arguments) {
  const HodgkinHuxleyArguments<hn::TFromD<D>> a = arguments;  // a local copy: nothing aliases it
  const VectorConstants<D> c(*a.constants);
  for_each_run(a, [&](std::size_t begin, std::size_t end) MERKEL_INLINE_LAMBDA {
    for (int step = 0; step < a.call.steps; ++step) {
      step_range<kFast, false>(d, a, c, begin, end, step, 0);
    }
    for (std::size_t i = begin; i < end; ++i) {
      if (HWY_UNLIKELY(!(std::fabs(a.V[i]) < static_cast<hn::TFromD<D>>(kRunaway_mV)))) {
        observe(a, i, 1, a.call.steps - 1, a.V + i, a.V + i);
      }
    }
  });
}

/// With a network: all neurons through one step, then the next.
template <bool kFast, class D>
HWY_INLINE void step_coupled(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& arguments) {
  const HodgkinHuxleyArguments<hn::TFromD<D>> a = arguments;
  const VectorConstants<D> c(*a.constants);
  int seen = a.seen_at_begin;
  for (int step = 0; step < a.call.steps; ++step) {
    for_each_run(a, [&](std::size_t begin, std::size_t end)
                        HWY_ATTR { step_range<kFast, true>(d, a, c, begin, end, step, seen); });
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
