// Explicit Runge-Kutta methods: forward Euler, Heun, RK4.
#include <algorithm>
#include <cmath>

#include "core/neurons/hodgkin_huxley/kernel/hodgkin_huxley_kernel.hpp"
#include "core/neurons/neuron_arrays.hpp"
#include "core/neurons/spike_detector.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/hodgkin_huxley/kernel/runge_kutta.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/hodgkin_huxley/kernel/rates-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// One kernel call with vectors of D.
template <class D>
class RungeKutta {
 public:
  using Real = hn::TFromD<D>;
  using Math = SideBySide<D, 1>;
  using Neurons = RightHandSide<D, 1>;
  using X = VectorPack<D, 1>;

  RungeKutta(const HodgkinHuxleyArguments<Real>& arguments, const RungeKuttaScheme& scheme,
             const RungeKuttaScratch<Real>& scratch)
      : a_(arguments), scheme_(scheme), scratch_(scratch), c_(*arguments.constants) {}

  /// With a network, takes all neurons through one stage, then the next, because neighbours need
  /// each other's stages. Otherwise takes a few blocks at a time through all steps.
  void run() {
    constexpr std::size_t kChunk = 4 * kNeuronBlock;
    const std::size_t chunk = coupled() ? a_.call.last - a_.call.first : kChunk;
    for (std::size_t begin = a_.call.first; begin < a_.call.last; begin += chunk) {
      const std::size_t end = std::min(begin + chunk, a_.call.last);
      seen_ = a_.seen_at_begin;
      for (int step = 0; step < a_.call.steps; ++step) take_step(begin, end, step);
    }
  }

 private:
  struct Slopes {
    X V, n, m, h;
  };

  [[nodiscard]] bool coupled() const { return a_.coupling.outflow != nullptr; }
  [[nodiscard]] bool frozen(std::size_t i) const {
    return a_.frozen != nullptr && a_.frozen[i / kNeuronBlock] != 0;
  }

  /// ẋ·dt of all four states at a point of the step.
  HWY_INLINE Slopes slopes(std::size_t i, const X& V, const X& n, const X& m, const X& h, int step,
                           double time) const {
    const RateFractions<X> r = Neurons::rates(V, c_, *a_.constants);
    const auto change = [](const Fraction<X>& rate, const X& x) HWY_ATTR {
      return Math::div(Math::fused_negative(rate.s, x, rate.p), rate.D);
    };
    const Channels<X> open = Neurons::channels({n, m, h}, c_);
    const Real phase =
        (static_cast<Real>(step) + static_cast<Real>(time)) / static_cast<Real>(a_.call.steps);
    X driven =
        Math::add(open.driven, Math::fused(Math::load(a_.input_change + i), hn::Set(D(), phase),
                                           Math::load(a_.input_begin + i)));
    X conductance = open.conductance;
    if (coupled()) {
      driven = Neurons::add_inflow(a_.coupling, seen_, i, driven);
      conductance = Math::add(conductance, Math::load(a_.coupling.outflow + i));
    }
    return {Math::div(Math::fused_negative(conductance, V, driven), c_.capacitance_per_step),
            change(r.n, n), change(r.m, m), change(r.h, h)};
  }

  /// Publishes a potential to the neighbours, or the resting potential if it is non-finite.
  HWY_INLINE void publish(std::size_t i, const X& V) const {
    const auto sane = Math::less(Math::abs(V), Math::constant(kRunaway_mV));
    Math::store(Math::select(sane, V, hn::Set(D(), a_.constants->V_rest)),
                a_.coupling.seen[1 - seen_] + i);
  }

  HWY_NOINLINE void take_stage(std::size_t i, int step, int stage) {
    Real* const state[4] = {a_.V, a_.n, a_.m, a_.h};
    X at[4];
    X x[4];
    X sum[4];
    for (int k = 0; k < 4; ++k) {
      x[k] = Math::load(state[k] + i);
      at[k] = stage == 0 ? x[k] : Math::load(scratch_.stage[k] + i);
      sum[k] = stage == 0 ? x[k] : Math::load(scratch_.result[k] + i);
    }
    const Slopes slope = slopes(i, at[0], at[1], at[2], at[3], step, scheme_.time[stage]);
    const X dx[4] = {slope.V, slope.n, slope.m, slope.h};
    if (stage == 0) Math::store(slope.V, scratch_.slope + i);
    const hn::Vec<D> weight = Math::constant(scheme_.weight[stage]);
    for (int k = 0; k < 4; ++k) sum[k] = Math::fused(dx[k], weight, sum[k]);
    if (stage + 1 < scheme_.stages) {
      const hn::Vec<D> ahead = Math::constant(scheme_.time[stage + 1]);
      for (int k = 0; k < 4; ++k) {
        at[k] = Math::fused(dx[k], ahead, x[k]);
        Math::store(at[k], scratch_.stage[k] + i);
        Math::store(sum[k], scratch_.result[k] + i);
      }
      if (coupled()) publish(i, at[0]);
      return;
    }
    // Last stage: keep the potentials before the step for spike detection.
    Math::store(x[0], scratch_.stage[0] + i);
    for (int k = 0; k < 4; ++k) Math::store(sum[k], state[k] + i);
    if (coupled()) publish(i, sum[0]);
    const auto sane = Math::less(Math::abs(sum[0]), Math::constant(kRunaway_mV));
    rare_ = rare_ ||
            Math::any(Math::either(Math::rises(x[0], sum[0], c_.threshold), Math::inverse(sane)));
  }

  void take_step(std::size_t begin, std::size_t end, int step) {
    const std::size_t lanes = hn::Lanes(D());
    rare_ = false;
    for (int stage = 0; stage < scheme_.stages; ++stage) {
      for (std::size_t i = begin; i < end; i += lanes) {
        if (!frozen(i)) take_stage(i, step, stage);
      }
      if (!coupled()) continue;
      seen_ = 1 - seen_;
      if (a_.call.peers != nullptr) a_.call.peers->barrier();
    }
    if (!HWY_UNLIKELY(rare_)) return;
    for (std::size_t i = begin; i < end; i += lanes) {
      if (!frozen(i)) observe(i, step);
    }
  }

  /// Reports spikes and non-finite states of a vector of neurons, and resets non-finite states.
  /// The slopes at both ends of the step determine the spike times.
  HWY_NOINLINE void observe(std::size_t i, int step) {
    HWY_ALIGN Real slope_after[hn::MaxLanes(D())];
    bool known = false;
    const NeuronConstants<Real>& c = *a_.constants;
    const Real* const before = scratch_.stage[0] + i;
    const Real* const after = a_.V + i;
    const auto crossing = [&](std::size_t lane) HWY_ATTR {
      if (!known) {
        known = true;
        Math::store(slopes(i, Math::load(a_.V + i), Math::load(a_.n + i), Math::load(a_.m + i),
                           Math::load(a_.h + i), step, 1.0)
                        .V,
                    slope_after);
      }
      return hermite_crossing(
          static_cast<double>(before[lane]), static_cast<double>(scratch_.slope[i + lane]),
          static_cast<double>(after[lane]), static_cast<double>(slope_after[lane]), c.threshold_mV);
    };
    observe_step(a_.call, step, i, std::min(hn::Lanes(D()), a_.call.last - i), c.threshold, before,
                 after, crossing, [&](std::size_t neuron) { reset_neuron(a_, neuron); });
  }

  const HodgkinHuxleyArguments<Real> a_;
  const RungeKuttaScheme scheme_;
  const RungeKuttaScratch<Real> scratch_;
  const VectorConstants<D> c_;
  int seen_ = 0;
  bool rare_ = false;
};

void runge_kutta_double(const HodgkinHuxleyArguments<double>& arguments,
                        const RungeKuttaScheme& scheme, const RungeKuttaScratch<double>& scratch) {
  RungeKutta<hn::ScalableTag<double>>(arguments, scheme, scratch).run();
}

void runge_kutta_float(const HodgkinHuxleyArguments<float>& arguments,
                       const RungeKuttaScheme& scheme, const RungeKuttaScratch<float>& scratch) {
  RungeKutta<hn::ScalableTag<float>>(arguments, scheme, scratch).run();
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(runge_kutta_double);
HWY_EXPORT(runge_kutta_float);

void step_hodgkin_huxley(const HodgkinHuxleyArguments<double>& arguments,
                         const RungeKuttaScheme& scheme,
                         const RungeKuttaScratch<double>& scratch) noexcept {
  HWY_DYNAMIC_DISPATCH(runge_kutta_double)(arguments, scheme, scratch);
}

void step_hodgkin_huxley(const HodgkinHuxleyArguments<float>& arguments,
                         const RungeKuttaScheme& scheme,
                         const RungeKuttaScratch<float>& scratch) noexcept {
  HWY_DYNAMIC_DISPATCH(runge_kutta_float)(arguments, scheme, scratch);
}

}  // namespace merkel
#endif
