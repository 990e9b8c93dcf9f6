#include "core/neurons/connor_stevens/connor_stevens_kernel.hpp"

#include <cmath>

#include "core/math/portable_math.hpp"
#include "core/neurons/spike_detector.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/connor_stevens/connor_stevens_kernel.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/noisy_steps-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

using Args = ConnorStevensArguments;

/// Reports spikes and non-finite states of `count` neurons from i on, and resets non-finite states.
HWY_NOINLINE void observe(const Args& a, std::size_t i, std::size_t count, int step,
                          const double* before, const double* after) {
  const double threshold = a.neuron->spike_threshold_mV;
  observe_step(
      a.call, step, i, count, threshold, before, after,
      [&](std::size_t lane) { return linear_crossing(before[lane], after[lane], threshold); },
      [&](std::size_t neuron) {
        a.V[neuron] = a.resting_V_mV;
        for (std::size_t k = 0; k < GateTable::kGates; ++k) {
          a.gates[k][neuron] = a.resting_gates[k];
        }
      });
}

/// Takes one vector of neurons through one step.
template <bool kNoisy>
struct ConnorStevensStep {
  using D = hn::ScalableTag<double>;
  using Math = SideBySide<D, 1>;
  using X = VectorPack<D, 1>;
  using V = hn::Vec<D>;
  using Signed = hn::RebindToSigned<D>;

  HWY_INLINE explicit ConnorStevensStep(const Args& arguments)
      : a(arguments),
        c(*a.neuron),
        capacitance_per_step(Math::constant(c.capacitance_uF_per_cm2 / a.step_ms)),
        half(Math::constant(0.5)),
        lowest(Math::constant(GateTable::kLowest_mV)),
        highest(Math::constant(GateTable::kHighest_mV - 1.0 / GateTable::kPer_mV)),
        shift(Math::constant(4503599627370496.0)) {}

  /// Advances the gates by one step, with the table's rows next to the potential.
  HWY_INLINE void step_gates(std::size_t i, const X& potential, X* x) const {
    const X place = Math::mul(Math::sub(Math::min(Math::max(potential, lowest), highest), lowest),
                              Math::constant(GateTable::kPer_mV));
    const X whole = Math::floor(place);
    const X beyond = Math::sub(place, whole);
    const auto number =
        hn::Sub(hn::BitCast(Signed(), Math::add(whole, shift).v[0]), hn::BitCast(Signed(), shift));
    // row·20 = row·16 + row·4
    const auto row = hn::Add(hn::ShiftLeft<4>(number), hn::ShiftLeft<2>(number));
    const auto column = [&](const double* from) HWY_ATTR {
      X values;
      values.v[0] = hn::GatherIndex(D(), from, row);
      return values;
    };
    for (std::size_t gate = 0; gate < GateTable::kGates; ++gate) {
      const double* const first = a.gate_table + 4 * gate;
      const X p = Math::add(column(first), Math::mul(beyond, column(first + 1)));
      const X q = Math::add(column(first + 2), Math::mul(beyond, column(first + 3)));
      x[gate] = Math::add(Math::mul(p, Math::load(a.gates[gate] + i)), q);
      Math::store(x[gate], a.gates[gate] + i);
    }
  }

  HWY_INLINE void operator()(std::size_t i, int step, V phase, const double* noise) const {
    const X before = Math::load(a.V + i);
    X x[GateTable::kGates];
    step_gates(i, before, x);
    const X m3h = Math::mul(Math::mul(Math::mul(x[0], x[0]), x[0]), x[1]);
    const X n2 = Math::mul(x[2], x[2]);
    const X a3b = Math::mul(Math::mul(Math::mul(x[3], x[3]), x[3]), x[4]);
    const auto set = [](double value) HWY_ATTR { return Math::constant(value); };
    const X sodium = Math::mul(set(c.g_Na), m3h);
    const X potassium = Math::mul(set(c.g_K), Math::mul(n2, n2));
    const X transient = Math::mul(set(c.g_A), a3b);
    const X conductance = Math::add(Math::add(set(c.g_L), sodium), Math::add(potassium, transient));
    const X current =
        Math::add(Math::load(a.input_begin + i), Math::mul(Math::load(a.input_change + i), phase));
    const X driven = Math::add(
        Math::add(Math::mul(sodium, set(c.E_Na)), Math::mul(potassium, set(c.E_K))),
        Math::add(Math::mul(transient, set(c.E_A)), Math::add(set(c.g_L * c.E_L), current)));
    X after =
        Math::add(before, Math::div(Math::sub(driven, Math::mul(conductance, before)),
                                    Math::add(capacitance_per_step, Math::mul(half, conductance))));
    if constexpr (kNoisy) {
      const X share = Math::min(
          Math::max(Math::mul(Math::sub(current, set(a.quiet_input)), set(a.share_per_input)),
                    set(a.least_share)),
          set(1.0));
      after = Math::add(
          after, Math::mul(Math::mul(set(a.noise_per_step), Math::sqrt(share)), Math::load(noise)));
    }
    Math::store(after, a.V + i);
    if (HWY_UNLIKELY(Math::any(Math::rises(before, after, set(c.spike_threshold_mV))))) {
      HWY_ALIGN double from[hn::MaxLanes(D())];
      HWY_ALIGN double to[hn::MaxLanes(D())];
      Math::store(before, from);
      Math::store(after, to);
      observe(a, i, hn::Lanes(D()), step, from, to);
    }
  }

  const Args a;  ///< local copy: no other pointer can alias it
  const ConnorStevens c;
  V capacitance_per_step, half, lowest, highest;
  V shift;  ///< 2^52: adding it puts an integer into the low bits
};

void step_connor_stevens_all(const Args& a) {
  using D = hn::ScalableTag<double>;
  if (a.noise_per_step > 0.0) {
    take_noisy_steps<true, D>(a.call, a.noise_key, ConnorStevensStep<true>(a));
  } else {
    take_noisy_steps<false, D>(a.call, nullptr, ConnorStevensStep<false>(a));
  }
  // A non-finite state affects only its own neuron, so one check per call is enough.
  for (std::size_t i = a.call.first; i < a.call.last; ++i) {
    if (HWY_UNLIKELY(!(std::fabs(a.V[i]) < kRunaway_mV))) {
      observe(a, i, 1, a.call.steps - 1, a.V + i, a.V + i);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(step_connor_stevens_all);

void step_connor_stevens(const ConnorStevensArguments& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(step_connor_stevens_all)(arguments);
}

GateTable::GateTable(double step_ms) {
  constexpr auto kRows = static_cast<std::size_t>((kHighest_mV - kLowest_mV) * kPer_mV);
  values_ = AlignedArray<double>((kRows + 1) * kRow);
  for (std::size_t row = 0; row <= kRows; ++row) {
    const auto kinetics = ConnorStevens::kinetics(kLowest_mV + static_cast<double>(row) / kPer_mV);
    const ConnorStevens::Gates& steady = kinetics.steady;
    const ConnorStevens::Gates& tau = kinetics.tau_ms;
    const double steady_of[kGates] = {steady.m, steady.h, steady.n, steady.a, steady.b};
    const double tau_of[kGates] = {tau.m, tau.h, tau.n, tau.a, tau.b};
    for (std::size_t gate = 0; gate < kGates; ++gate) {
      double* const here = values_.data() + row * kRow + 4 * gate;
      here[0] = portable_exp(-step_ms / tau_of[gate]);
      here[2] = -steady_of[gate] * portable_expm1(-step_ms / tau_of[gate]);
      if (row == 0) continue;
      double* const previous = here - kRow;
      previous[1] = here[0] - previous[0];
      previous[3] = here[2] - previous[2];
    }
  }
}

}  // namespace merkel
#endif
