#include "core/neurons/integrate_and_fire/integrate_and_fire_kernel.hpp"

#include "core/neurons/hodgkin_huxley/kernel/membrane_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/integrate_and_fire/integrate_and_fire_kernel.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/normal_noise-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

using Args = IntegrateAndFireArguments;

/// Tells the observer of the spikes among `count` neurons from i on.
HWY_NOINLINE void tell(const Args& a, std::size_t i, std::size_t count, int step,
                       const double* spiked, const double* time) {
  for (std::size_t lane = 0; lane < count; ++lane) {
    if (spiked[lane] != 0.0 && i + lane < a.last) {
      a.observer->spiked(i + lane, step, time[lane] / a.step);
    }
  }
}

/// One block of neurons through all steps.
template <bool kNoisy>
HWY_INLINE void step_block(const Args& a, std::size_t block) {
  const hn::ScalableTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d);
  const V dt = hn::Set(d, a.step);
  const V zero = hn::Zero(d);
  const V inverse_tau = hn::Set(d, a.inverse_tau);
  const V threshold = hn::Set(d, a.threshold);
  const V reset = hn::Set(d, a.reset);
  const V floor = hn::Set(d, a.floor);
  const V refractory = hn::Set(d, a.refractory);
  const V sigma = hn::Set(d, a.sigma);
  HWY_ALIGN double noise[kNeuronBlock];
  for (int step = 0; step < a.steps; ++step) {
    const V phase = hn::Set(d, (step + 0.5) / a.steps);
    if constexpr (kNoisy) {
      NormalNoise<decltype(d)>::fill(a.noise_key + block / 2,
                                     a.steps_before + static_cast<std::uint64_t>(step), noise);
    }
    for (std::size_t i = block; i < block + kNeuronBlock; i += lanes) {
      const V before = hn::LoadU(d, a.v + i);
      const V left = hn::LoadU(d, a.refractory_left + i);
      const V waited = hn::Min(left, dt);
      const V h = hn::Sub(dt, waited);
      const V current = hn::Add(hn::LoadU(d, a.current_begin + i),
                                hn::Mul(hn::LoadU(d, a.current_change + i), phase));
      V v = hn::Add(before, hn::Mul(hn::Sub(current, hn::Mul(before, inverse_tau)), h));
      if constexpr (kNoisy) {
        v = hn::Add(v, hn::Mul(hn::Mul(sigma, hn::Sqrt(h)), hn::LoadU(d, noise + i - block)));
      }
      v = hn::Max(v, floor);
      V left_after = hn::Sub(left, waited);
      const auto spikes = hn::Ge(v, threshold);
      if (HWY_UNLIKELY(!hn::AllFalse(d, spikes))) {
        const V fraction = hn::Div(hn::Sub(threshold, before), hn::Sub(v, before));
        const V time = hn::Add(waited, hn::Mul(hn::Min(fraction, hn::Set(d, 1.0)), h));
        HWY_ALIGN double spiked[hn::MaxLanes(d)];
        HWY_ALIGN double at[hn::MaxLanes(d)];
        hn::Store(hn::IfThenElse(spikes, hn::Set(d, 1.0), zero), d, spiked);
        hn::Store(time, d, at);
        tell(a, i, lanes, step, spiked, at);
        v = hn::IfThenElse(spikes, reset, v);
        left_after = hn::IfThenElse(spikes, hn::Max(hn::Sub(refractory, hn::Sub(dt, time)), zero),
                                    left_after);
      }
      hn::StoreU(v, d, a.v + i);
      hn::StoreU(left_after, d, a.refractory_left + i);
    }
  }
}

void step_integrate_and_fire_all(const Args& arguments) {
  const Args a = arguments;  // of our own: nobody else can write to it
  for (std::size_t block = a.first; block < a.last; block += kNeuronBlock) {
    a.sigma > 0.0 ? step_block<true>(a, block) : step_block<false>(a, block);
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
