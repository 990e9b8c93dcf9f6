// How the kernels with one rate evaluation per step iterate over neurons and steps: in stages, run
// by run.
#if defined(CORE_NEURONS_HODGKIN_HUXLEY_STEPPING_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CORE_NEURONS_HODGKIN_HUXLEY_STEPPING_INL_HPP
#undef CORE_NEURONS_HODGKIN_HUXLEY_STEPPING_INL_HPP
#else
#define CORE_NEURONS_HODGKIN_HUXLEY_STEPPING_INL_HPP
#endif

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/neurons/hodgkin_huxley/kernel/hodgkin_huxley_kernel.hpp"
#include "core/neurons/hodgkin_huxley/kernel/rates-inl.hpp"
#include "core/neurons/neuron_arrays.hpp"
#include "core/neurons/spike_detector.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// A number of vectors to process at a time.
template <int kCount>
using Vectors = std::integral_constant<int, kCount>;

/// Calls work(Vectors<kMax>(), i) for i in [begin, end); at the end, one vector at a time.
template <int kMax, class D, class Work>
HWY_INLINE void for_each_pack(D d, std::size_t begin, std::size_t end, const Work& work) {
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = begin;
  for (; i + (kMax - 1) * lanes < end; i += kMax * lanes) work(Vectors<kMax>(), i);
  for (; i < end; i += lanes) work(Vectors<1>(), i);
}

/// The fraction of the call at which the current of a step is taken.
template <class D>
HWY_INLINE hn::Vec<D> phase_of(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& a, int step) {
  return hn::Set(d, (static_cast<hn::TFromD<D>>(step) + a.input_phase) /
                        static_cast<hn::TFromD<D>>(a.call.steps));
}

/// Number of neurons that go through the stages of a step together. Their data stays in the L1
/// cache.
constexpr std::size_t kStaged = 8 * kNeuronBlock;

/// The step of a method with the shared exponential, in stages, each a loop over a block of
/// neurons. The whole step is one chain of dependent operations, longer than the processor's
/// look-ahead; within a stage, the operations of different vectors overlap. The operations on each
/// neuron are the same as without stages.
template <class Method, class D>
class StagedStep {
 public:
  using Real = hn::TFromD<D>;
  using Arguments = HodgkinHuxleyArguments<Real>;
  using Constants = VectorConstants<D>;

  /// Vectors of 64 bytes need less overlap: in double precision the two stages of the gates are
  /// merged, in single precision the whole step is one stage.
  static constexpr bool kWide = hn::MaxLanes(D()) * sizeof(Real) >= 64;
  static constexpr bool kPays = !kWide || sizeof(Real) == 8;

  /// Neurons [begin, end), at most kStaged.
  static HWY_INLINE void take(const Arguments& a, const Constants& c, std::size_t begin,
                              std::size_t end, int step, int seen) {
    Memory memory;
    find_exponentials(a, c, begin, end, memory);
    if constexpr (kWide) {
      step_gates(a, c, begin, end, step, memory);
    } else {
      find_gate_steps(a, c, begin, end, step, memory);
      take_gate_steps(a, c, begin, end, step, memory);
    }
    step_potentials(a, c, begin, end, step, seen);
  }

 private:
  template <int kCount>
  using Pieces = typename Method::template Pieces<kCount>;
  template <int kCount>
  using Math = SideBySide<D, kCount>;
  template <int kCount>
  using Neurons = RightHandSide<D, kCount>;
  template <int kCount>
  using Gates = GateValues<VectorPack<D, kCount>>;
  template <int kCount>
  using Steps = GateSteps<VectorPack<D, kCount>>;

  using ForGates = Real[3][kStaged];
  /// The values that the stages pass on, by neuron of the block.
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
                                             int step, const Memory& memory, std::size_t k) {
    return Pieces<kCount>::gate_steps(
        a, c, i, step,
        Neurons<kCount>::shared_rates(
            {.w = Math<kCount>::load(memory.w + k), .b = Math<kCount>::load(memory.b + k)}, c));
  }

  static HWY_NOINLINE void find_exponentials(const Arguments& arguments, const Constants& c,
                                             std::size_t begin, std::size_t end, Memory& memory) {
    const Arguments a = arguments;  // local copy, here and below: nothing aliases it
    for_each_pack<4>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      const auto found = Neurons<count>::shared_exponential(Math<count>::load(a.V + i), c);
      Math<count>::store(found.w, memory.w + (i - begin));
      Math<count>::store(found.b, memory.b + (i - begin));
    });
  }
  static HWY_NOINLINE void find_gate_steps(const Arguments& arguments, const Constants& c,
                                           std::size_t begin, std::size_t end, int step,
                                           Memory& memory) {
    const Arguments a = arguments;
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      const Steps<count> steps = gate_steps<count>(a, c, i, step, memory, i - begin);
      store<count>(steps.denominator, memory.denominator, i - begin);
      store<count>(steps.change, memory.change, i - begin);
    });
  }
  /// The division, and the gates after the step.
  static HWY_NOINLINE void take_gate_steps(const Arguments& arguments, const Constants& c,
                                           std::size_t begin, std::size_t end, int step,
                                           const Memory& memory) {
    const Arguments a = arguments;
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      Pieces<count>::take(a, c, i, step,
                          {.change = load<count>(memory.change, i - begin),
                           .denominator = load<count>(memory.denominator, i - begin)});
    });
  }
  /// Both in one stage.
  static HWY_NOINLINE void step_gates(const Arguments& arguments, const Constants& c,
                                      std::size_t begin, std::size_t end, int step,
                                      const Memory& memory) {
    const Arguments a = arguments;
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      Pieces<count>::take(a, c, i, step, gate_steps<count>(a, c, i, step, memory, i - begin));
    });
  }
  static HWY_NOINLINE void step_potentials(const Arguments& a, const Constants& c,
                                           std::size_t begin, std::size_t end, int step, int seen) {
    const auto phase = phase_of(D(), a, step);
    for_each_pack<2>(D(), begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
      Pieces<count>::step_potential(a, c, i, step, phase, seen, Neurons<count>::load_gates(a, i));
    });
  }
};

/// Takes the neurons [begin, end) through one step.
template <class Method, class D>
HWY_INLINE void step_range(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& a,
                           const VectorConstants<D>& c, std::size_t begin, std::size_t end,
                           int step, int seen) {
  if constexpr (Method::kShared && StagedStep<Method, D>::kPays) {
    StagedStep<Method, D>::take(a, c, begin, end, step, seen);
  } else {
    const auto phase = phase_of(d, a, step);
    for_each_pack<Method::kShared ? 2 : 1>(
        d, begin, end, [&](auto count, std::size_t i) MERKEL_INLINE_LAMBDA {
          Method::template Pieces<count>::step_all(a, c, i, step, phase, seen);
        });
  }
}

/// Calls work(begin, end) for each run of blocks that are not frozen, at most
/// kStaged neurons at a time.
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

/// Takes all steps. Without a network: a run of blocks through all steps, which
/// stays in the nearest cache. With a network: all neurons through one step,
/// then the next. \param Method  kShared: always with the shared exponential;
/// kCoupled; Pieces<kCount>: the arithmetic of a step on kCount vectors;
/// kObserve: reports spikes and resets
template <class Method, class D>
HWY_INLINE void take_steps(D d, const HodgkinHuxleyArguments<hn::TFromD<D>>& arguments) {
  const HodgkinHuxleyArguments<hn::TFromD<D>> a = arguments;  // a local copy: nothing aliases it
  const VectorConstants<D> c(*a.constants);
  if constexpr (Method::kCoupled) {
    int seen = a.seen_at_begin;
    for (int step = 0; step < a.call.steps; ++step) {
      for_each_run(a, [&](std::size_t begin, std::size_t end) MERKEL_INLINE_LAMBDA {
        step_range<Method>(d, a, c, begin, end, step, seen);
      });
      seen = 1 - seen;
      if (a.call.peers != nullptr) a.call.peers->barrier();
    }
    return;
  }
  for_each_run(a, [&](std::size_t begin, std::size_t end) MERKEL_INLINE_LAMBDA {
    for (int step = 0; step < a.call.steps; ++step) {
      step_range<Method>(d, a, c, begin, end, step, 0);
    }
    for (std::size_t i = begin; i < end; ++i) {
      if (HWY_UNLIKELY(!(std::fabs(a.V[i]) < static_cast<hn::TFromD<D>>(kRunaway_mV)))) {
        Method::kObserve(a, i, 1, a.call.steps - 1, a.V + i, a.V + i);
      }
    }
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#endif
