#include "core/neurons/connor_stevens/connor_stevens_kernel.hpp"

#include "core/math/portable_math.hpp"
#include "core/neurons/hodgkin_huxley/kernel/membrane_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/connor_stevens/connor_stevens_kernel.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/normal_noise-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// Tells the observer of the crossings among `count` neurons from i on.
HWY_NOINLINE void tell(const ConnorStevensArguments& a, std::size_t i, std::size_t count, int step,
                       const double* before, const double* after) {
  const double threshold = a.neuron->spike_threshold_mV;
  for (std::size_t lane = 0; lane < count; ++lane) {
    if (before[lane] < threshold && after[lane] >= threshold && i + lane < a.last) {
      a.observer->spiked(i + lane, step, (threshold - before[lane]) / (after[lane] - before[lane]));
    }
  }
}

/// One block of neurons through all steps.
template <bool kNoisy>
HWY_INLINE void step_block(const ConnorStevensArguments& a, std::size_t block) {
  const hn::ScalableTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const ConnorStevens& c = *a.neuron;
  const auto set = [&](double value) HWY_ATTR { return hn::Set(d, value); };
  const V capacitance_per_step = set(c.capacitance_uF_per_cm2 / a.step_ms);
  const V half = set(0.5);
  const V lowest = set(GateTable::kLowest_mV);
  const V highest = set(GateTable::kHighest_mV - 1.0 / GateTable::kPer_mV);
  const V shift = set(4503599627370496.0);  // 2^52: a whole number added stands in the low bits
  HWY_ALIGN double noise[kNeuronBlock];
  for (int step = 0; step < a.steps; ++step) {
    const V phase = set((step + 0.5) / a.steps);
    if constexpr (kNoisy) {
      NormalNoise<decltype(d)>::fill(a.noise_key + block / 2,
                                     a.steps_before + static_cast<std::uint64_t>(step), noise);
    }
    for (std::size_t i = block; i < block + kNeuronBlock; i += lanes) {
      const V before = hn::LoadU(d, a.V + i);
      const V place = hn::Mul(hn::Sub(hn::Min(hn::Max(before, lowest), highest), lowest),
                              set(GateTable::kPer_mV));
      const V whole = hn::Floor(place);
      const V beyond = hn::Sub(place, whole);
      const auto number = hn::Sub(hn::BitCast(di, hn::Add(whole, shift)), hn::BitCast(di, shift));
      // row·20 = row·16 + row·4
      const auto row = hn::Add(hn::ShiftLeft<4>(number), hn::ShiftLeft<2>(number));
      V x[GateTable::kGates];
      for (std::size_t gate = 0; gate < GateTable::kGates; ++gate) {
        const double* const column = a.gate_table + 4 * gate;
        const V p = hn::Add(hn::GatherIndex(d, column, row),
                            hn::Mul(beyond, hn::GatherIndex(d, column + 1, row)));
        const V q = hn::Add(hn::GatherIndex(d, column + 2, row),
                            hn::Mul(beyond, hn::GatherIndex(d, column + 3, row)));
        x[gate] = hn::Add(hn::Mul(p, hn::LoadU(d, a.gates[gate] + i)), q);
        hn::StoreU(x[gate], d, a.gates[gate] + i);
      }
      const V m3h = hn::Mul(hn::Mul(hn::Mul(x[0], x[0]), x[0]), x[1]);
      const V n2 = hn::Mul(x[2], x[2]);
      const V a3b = hn::Mul(hn::Mul(hn::Mul(x[3], x[3]), x[3]), x[4]);
      const V sodium = hn::Mul(set(c.g_Na), m3h);
      const V potassium = hn::Mul(set(c.g_K), hn::Mul(n2, n2));
      const V transient = hn::Mul(set(c.g_A), a3b);
      const V conductance = hn::Add(hn::Add(set(c.g_L), sodium), hn::Add(potassium, transient));
      const V current = hn::Add(hn::LoadU(d, a.current_begin + i),
                                hn::Mul(hn::LoadU(d, a.current_change + i), phase));
      const V driven =
          hn::Add(hn::Add(hn::Mul(sodium, set(c.E_Na)), hn::Mul(potassium, set(c.E_K))),
                  hn::Add(hn::Mul(transient, set(c.E_A)), hn::Add(set(c.g_L * c.E_L), current)));
      V after = hn::Add(before, hn::Div(hn::Sub(driven, hn::Mul(conductance, before)),
                                        hn::Add(capacitance_per_step, hn::Mul(half, conductance))));
      if constexpr (kNoisy) {
        after = hn::Add(after, hn::Mul(set(a.noise_per_step), hn::LoadU(d, noise + i - block)));
      }
      hn::StoreU(after, d, a.V + i);
      const V threshold = set(c.spike_threshold_mV);
      const auto crossed = hn::AndNot(hn::Lt(after, threshold), hn::Lt(before, threshold));
      if (HWY_UNLIKELY(!hn::AllFalse(d, crossed))) {
        HWY_ALIGN double from[hn::MaxLanes(d)];
        HWY_ALIGN double to[hn::MaxLanes(d)];
        hn::Store(before, d, from);
        hn::Store(after, d, to);
        tell(a, i, lanes, step, from, to);
      }
    }
  }
}

void step_connor_stevens_all(const ConnorStevensArguments& arguments) {
  const ConnorStevensArguments a = arguments;  // of our own: nobody else can write to it
  for (std::size_t block = a.first; block < a.last; block += kNeuronBlock) {
    a.noise_per_step > 0.0 ? step_block<true>(a, block) : step_block<false>(a, block);
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
