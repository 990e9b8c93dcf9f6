#include "core/neurons/integrate_and_fire/integrate_and_fire_kernel.hpp"

#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/integrate_and_fire/integrate_and_fire_kernel.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/noisy_steps-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

using Args = IntegrateAndFireArguments;

/// Reports the spikes of `count` neurons from i on.
HWY_NOINLINE void report_spikes(const Args& a, std::size_t i, std::size_t count, int step,
                                const double* spiked, const double* time) {
  for (std::size_t lane = 0; lane < count; ++lane) {
    if (spiked[lane] != 0.0 && i + lane < a.call.last) {
      a.call.observer->spiked(i + lane, step, time[lane] / a.step);
    }
  }
}

/// Takes one vector of neurons through one step.
template <bool kNoisy>
struct IntegrateAndFireStep {
  using D = hn::ScalableTag<double>;
  using Math = SideBySide<D, 1>;
  using X = VectorPack<D, 1>;
  using V = hn::Vec<D>;

  HWY_INLINE explicit IntegrateAndFireStep(const Args& arguments)
      : a(arguments),
        dt(Math::constant(a.step)),
        inverse_tau(Math::constant(a.inverse_tau)),
        threshold(Math::constant(a.threshold)),
        reset(Math::constant(a.reset)),
        floor(Math::constant(a.floor)),
        sigma(Math::constant(a.sigma)),
        share_per_Hz(Math::constant(a.share_per_Hz)),
        least_share(Math::constant(a.least_share)),
        rest_below(Math::constant(a.rest_below)) {}

  HWY_INLINE void operator()(std::size_t i, int step, V phase, const double* noise) const {
    const X before = Math::load(a.v + i);
    const X left = Math::load(a.refractory_left + i);
    const X waited = Math::min(left, dt);
    const X h = Math::sub(dt, waited);
    const X input =
        Math::add(Math::load(a.input_begin + i), Math::mul(Math::load(a.input_change + i), phase));
    X v = Math::add(before, Math::mul(Math::sub(input, Math::mul(before, inverse_tau)), h));
    if constexpr (kNoisy) {
      const X share =
          Math::min(Math::max(Math::mul(input, share_per_Hz), least_share), Math::constant(1.0));
      v = Math::add(
          v, Math::mul(Math::mul(sigma, Math::sqrt(Math::mul(h, share))), Math::load(noise)));
    }
    v = Math::max(v, floor);
    const V none = Math::constant(0.0);
    v = Math::select(Math::equal(input, none),
                     Math::select(Math::less(Math::abs(v), rest_below), none, v), v);
    X left_after = Math::sub(left, waited);
    const auto spikes = Math::at_least(v, threshold);
    if (HWY_UNLIKELY(Math::any(spikes))) {
      const V one = Math::constant(1.0);
      const V zero = Math::constant(0.0);
      const X fraction = Math::div(Math::sub(threshold, before), Math::sub(v, before));
      const X time = Math::add(waited, Math::mul(Math::min(fraction, one), h));
      HWY_ALIGN double spiked[hn::MaxLanes(D())];
      HWY_ALIGN double at[hn::MaxLanes(D())];
      Math::store(Math::select(spikes, one, zero), spiked);
      Math::store(time, at);
      report_spikes(a, i, hn::Lanes(D()), step, spiked, at);
      v = Math::select(spikes, reset, v);
      const X rest_of_period =
          Math::max(Math::sub(Math::constant(a.refractory), Math::sub(dt, time)), zero);
      left_after = Math::select(spikes, rest_of_period, left_after);
    }
    Math::store(v, a.v + i);
    Math::store(left_after, a.refractory_left + i);
  }

  const Args a;  ///< local copy: no other pointer can alias it
  V dt, inverse_tau, threshold, reset, floor, sigma, share_per_Hz, least_share, rest_below;
};

void step_integrate_and_fire_all(const Args& a) {
  using D = hn::ScalableTag<double>;
  if (a.sigma > 0.0) {
    take_noisy_steps<true, D>(a.call, a.noise_key, IntegrateAndFireStep<true>(a));
  } else {
    take_noisy_steps<false, D>(a.call, nullptr, IntegrateAndFireStep<false>(a));
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(step_integrate_and_fire_all);

void step_integrate_and_fire(const IntegrateAndFireArguments& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(step_integrate_and_fire_all)(arguments);
}

}  // namespace merkel
#endif
