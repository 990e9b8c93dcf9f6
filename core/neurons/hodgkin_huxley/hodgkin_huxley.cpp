#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"

#include <cmath>
#include <utility>

#include "core/math/portable_math.hpp"

namespace merkel {

Expected<void, ParameterError> HodgkinHuxley::check() const {
  ParameterCheck all;
  all.positive("neuron.capacitance_uF_per_cm2", capacitance_uF_per_cm2)
      .not_negative("neuron.g_Na", g_Na)
      .not_negative("neuron.g_K", g_K)
      .positive("neuron.g_L", g_L)
      .not_negative("neuron.g_CaL", g_CaL)
      .finite("neuron.E_Na", E_Na)
      .finite("neuron.E_K", E_K)
      .finite("neuron.E_Ca", E_Ca)
      .finite("neuron.V_rest", V_rest)
      .finite("neuron.spike_threshold_mV", spike_threshold_mV)
      .require(spike_threshold_mV > V_rest, "neuron.spike_threshold_mV", "must lie above V_rest");
  // Beyond these, no step is small enough, and neurons are reset all the time.
  for (const auto& [key, g] : {std::pair("neuron.g_Na", g_Na), std::pair("neuron.g_K", g_K),
                               std::pair("neuron.g_L", g_L), std::pair("neuron.g_CaL", g_CaL)}) {
    all.require(g <= 1e4, key, "must be at most 10000 mS/cm²");
  }
  for (const auto& [key, E] :
       {std::pair("neuron.E_Na", E_Na), std::pair("neuron.E_K", E_K),
        std::pair("neuron.E_Ca", E_Ca), std::pair("neuron.V_rest", V_rest)}) {
    all.require(std::fabs(E) <= 500.0, key, "must be from -500 to 500 mV");
  }
  return all.result();
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
