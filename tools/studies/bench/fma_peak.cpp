#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/studies/bench/fma_peak.cpp"
#include "tools/studies/bench/fma_peak.hpp"

#include <hwy/foreach_target.h>  // must precede highway.h: compiles this file once per target
#include <hwy/highway.h>

#include "tools/studies/bench/measure.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kRounds = 10'000;
constexpr int kChains = 10;  // independent; more than latency × ports

/// Ten chains of multiply-adds. \return the number of operations; the sum prevents their removal by
/// the compiler
template <class Real>
double run_chains(Real seed, Real& sum) {
  const hn::ScalableTag<Real> d;
  const auto factor = hn::Set(d, seed * Real(1e-9) + Real(0.999999));
  const auto term = hn::Set(d, seed * Real(1e-6));
  // Each chain has its own start value: a compiler merges identical chains.
  const auto begin = [&](Real share) HWY_ATTR { return hn::Set(d, seed * share); };
  auto a = begin(Real(0.1)), b = begin(Real(0.2)), c = begin(Real(0.3)), e = begin(Real(0.4)),
       f = begin(Real(0.5)), g = begin(Real(0.6)), h = begin(Real(0.7)), k = begin(Real(0.8)),
       l = begin(Real(0.9)), m = begin(Real(1.0));
  for (int round = 0; round < kRounds; ++round) {
    a = hn::MulAdd(a, factor, term);
    b = hn::MulAdd(b, factor, term);
    c = hn::MulAdd(c, factor, term);
    e = hn::MulAdd(e, factor, term);
    f = hn::MulAdd(f, factor, term);
    g = hn::MulAdd(g, factor, term);
    h = hn::MulAdd(h, factor, term);
    k = hn::MulAdd(k, factor, term);
    l = hn::MulAdd(l, factor, term);
    m = hn::MulAdd(m, factor, term);
  }
  const auto all = hn::Add(hn::Add(hn::Add(a, b), hn::Add(c, e)),
                           hn::Add(hn::Add(hn::Add(f, g), hn::Add(h, k)), hn::Add(l, m)));
  sum += hn::GetLane(all);
  return 2.0 * kChains * kRounds * static_cast<double>(hn::Lanes(d));
}

double run_double(double seed, double& sum) { return run_chains(seed, sum); }
double run_float(float seed, float& sum) { return run_chains(seed, sum); }

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(run_double);
HWY_EXPORT(run_float);

double fma_peak_gflops(Precision precision) {
  double operations = 0.0;
  double sum = 0.0;
  float float_sum = 0.0F;
  const Measurement measured = measure([&] {
    operations = precision == Precision::kDouble ? HWY_DYNAMIC_DISPATCH(run_double)(1.0, sum)
                                                 : HWY_DYNAMIC_DISPATCH(run_float)(1.0F, float_sum);
  });
  volatile double keep = sum + static_cast<double>(float_sum);
  static_cast<void>(keep);
  return operations / measured.median_s * 1e-9;
}

}  // namespace merkel
#endif
