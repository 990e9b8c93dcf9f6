#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"

#include "core/math/portable_math.hpp"

namespace merkel {

FieldTable HodgkinHuxley::fields() {
  using P = HodgkinHuxley;
  static constexpr Range kPotential = from_to(-500.0, 500.0);
  static constexpr Field kFields[] = {
      {"capacitance_uF_per_cm2", "µF/cm²", positive(1e3), "capacitance of the membrane",
       at<&P::capacitance_uF_per_cm2>},
      {"g_Na", "mS/cm²", not_negative(1e4), "sodium conductance", at<&P::g_Na>},
      {"g_K", "mS/cm²", not_negative(1e4), "potassium conductance", at<&P::g_K>},
      {"g_L", "mS/cm²", positive(1e4), "leak conductance", at<&P::g_L>},
      {"g_CaL", "mS/cm²", not_negative(1e4), "L-type calcium conductance", at<&P::g_CaL>},
      {"E_Na", "mV", kPotential, "reversal potential of sodium", at<&P::E_Na>},
      {"E_K", "mV", kPotential, "reversal potential of potassium", at<&P::E_K>},
      {"E_Ca", "mV", kPotential, "reversal potential of calcium", at<&P::E_Ca>},
      {"V_rest", "mV", kPotential, "resting potential; sets the reversal potential of the leak",
       at<&P::V_rest>},
      {"spike_threshold_mV", "mV", kPotential, "an upward crossing is a spike",
       at<&P::spike_threshold_mV>}};
  return {"neuron", kFields};
}

Expected<void, ParameterError> HodgkinHuxley::check() const {
  return ParameterCheck()
      .fields(*this)
      .require(spike_threshold_mV > V_rest, "neuron.spike_threshold_mV", "must lie above V_rest")
      .result();
}

double linoid(double x) noexcept { return x == 0.0 ? 1.0 : x / portable_expm1(x); }

GateRates HodgkinHuxley::rates(double V_mV) const noexcept {
  const double v = V_mV - V_rest;
  const auto opening = [v](const LinoidRate& p) {
    return p.rate_per_ms * linoid((p.shift_mV - v) / p.slope_mV);
  };
  const auto decaying = [v](const ExponentialRate& p) {
    return p.rate_per_ms * portable_exp(-v / p.slope_mV);
  };
  return {.alpha = {.n = opening(alpha_n), .m = opening(alpha_m), .h = decaying(alpha_h)},
          .beta = {.n = decaying(beta_n),
                   .m = decaying(beta_m),
                   .h = beta_h.rate_per_ms /
                        (portable_exp((beta_h.shift_mV - v) / beta_h.slope_mV) + 1.0)}};
}

Gates HodgkinHuxley::steady_gates(double V_mV) const noexcept {
  const auto [alpha, beta] = rates(V_mV);
  return {.n = alpha.n / (alpha.n + beta.n),
          .m = alpha.m / (alpha.m + beta.m),
          .h = alpha.h / (alpha.h + beta.h)};
}

double HodgkinHuxley::leak_reversal_mV() const noexcept {
  const Channels rest = channels(steady_gates(V_rest), V_rest);
  return V_rest - (rest.driven - rest.conductance * V_rest) / g_L;
}

HodgkinHuxley::Channels HodgkinHuxley::channels(const Gates& gates,
                                                double leak_reversal_mV) const noexcept {
  const double sodium = g_Na * gates.m * gates.m * gates.m * gates.h;
  const double potassium = g_K * gates.n * gates.n * gates.n * gates.n;
  const double calcium = g_CaL * gates.m * gates.h;
  return {.conductance = g_L + sodium + potassium + calcium,
          .driven = g_L * leak_reversal_mV + sodium * E_Na + potassium * E_K + calcium * E_Ca};
}

}  // namespace merkel
