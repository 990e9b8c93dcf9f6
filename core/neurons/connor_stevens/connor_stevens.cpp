#include "core/neurons/connor_stevens/connor_stevens.hpp"

#include "core/math/portable_math.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"

namespace merkel {
namespace {

/// x^(1/3) for x in (0, 8]: Newton's iteration, using only + − × ÷.
double cube_root(double x) {
  double y = x > 1.0 ? 2.0 : 1.0;
  for (int k = 0; k < 60; ++k) y = (y + y + x / (y * y)) / 3.0;
  return y;
}

}  // namespace

FieldTable ConnorStevens::fields() {
  using P = ConnorStevens;
  static constexpr Range kPotential = from_to(-500.0, 500.0);
  static constexpr Field kFields[] = {
      {"capacitance_uF_per_cm2", "µF/cm²", positive(1e3), "capacitance of the membrane",
       at<&P::capacitance_uF_per_cm2>},
      {"g_Na", "mS/cm²", not_negative(1e4), "sodium conductance", at<&P::g_Na>},
      {"g_K", "mS/cm²", not_negative(1e4), "potassium conductance", at<&P::g_K>},
      {"g_A", "mS/cm²", not_negative(1e4), "conductance of the A-current", at<&P::g_A>},
      {"g_L", "mS/cm²", positive(1e4), "leak conductance", at<&P::g_L>},
      {"E_Na", "mV", kPotential, "reversal potential of sodium", at<&P::E_Na>},
      {"E_K", "mV", kPotential, "reversal potential of potassium", at<&P::E_K>},
      {"E_A", "mV", kPotential, "reversal potential of the A-current", at<&P::E_A>},
      {"E_L", "mV", kPotential, "reversal potential of the leak", at<&P::E_L>},
      {"spike_threshold_mV", "mV", kPotential, "an upward crossing is a spike",
       at<&P::spike_threshold_mV>},
      {"noise", "mV/√ms", not_negative(1e6),
       "white noise: a step dt adds noise·√dt·ξ; requires seed",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->noise.sigma; }, "", true},
      {"seed", "", any_value(), "seed of the noise",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->noise.seed; }}};
  return {"neuron", kFields};
}

Expected<void, ParameterError> ConnorStevens::check() const {
  return ParameterCheck().fields(*this).result();
}

ConnorStevens::Kinetics ConnorStevens::kinetics(double V) noexcept {
  const auto e = [](double x) { return portable_exp(x); };
  Kinetics k;
  const auto set = [](double alpha, double beta, double& steady, double& tau) {
    steady = alpha / (alpha + beta);
    tau = 1.0 / (alpha + beta);
  };
  // α = rate·x/(1−e^{−x/10}) is 10·rate·φ(−x/10).
  set(3.8 * linoid(-0.1 * (V + 29.7)), 15.2 * e(-0.0556 * (V + 54.7)), k.steady.m, k.tau_ms.m);
  set(0.266 * e(-0.05 * (V + 48.0)), 3.8 / (1.0 + e(-0.1 * (V + 18.0))), k.steady.h, k.tau_ms.h);
  set(0.2 * linoid(-0.1 * (V + 45.7)), 0.25 * e(-0.0125 * (V + 55.7)), k.steady.n, k.tau_ms.n);
  k.steady.a = cube_root(0.0761 * e(0.0314 * (V + 94.22)) / (1.0 + e(0.0346 * (V + 1.17))));
  k.tau_ms.a = 0.3632 + 1.158 / (1.0 + e(0.0497 * (V + 55.96)));
  const double b = 1.0 / (1.0 + e(0.0688 * (V + 53.3)));
  k.steady.b = b * b * b * b;
  k.tau_ms.b = 1.24 + 2.678 / (1.0 + e(0.0624 * (V + 50.0)));
  return k;
}

}  // namespace merkel
