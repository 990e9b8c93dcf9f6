#include "core/neurons/hodgkin_huxley/kernel/neuron_constants.hpp"

#include <algorithm>

#include "core/math/portable_math.hpp"

namespace merkel {
namespace {

/// Whether the slopes allow one shared exponential and the potentials lie within its range.
bool can_share(const HodgkinHuxley& p, double leak_reversal_mV) {
  const double slope = p.alpha_n.slope_mV;
  const bool ratios = p.alpha_m.slope_mV == slope && p.beta_h.slope_mV == slope &&
                      p.beta_n.slope_mV == 8.0 * slope && p.alpha_h.slope_mV == 2.0 * slope &&
                      p.beta_m.slope_mV == 1.8 * slope;
  // Potentials stay between the extreme reversal potentials of the dominant conductances.
  const double centre = p.V_rest + NeuronConstants<double>::kCentre_mV;
  const double half = NeuronConstants<double>::kHalfRange_mV;
  const double lowest = std::min({p.E_K, leak_reversal_mV, p.V_rest});
  const double highest = std::max({p.E_Na, leak_reversal_mV, p.V_rest});
  return ratios && slope >= 10.0 && lowest > centre - half && highest < centre + half;
}

}  // namespace

template <class Real>
NeuronConstants<Real>::NeuronConstants(const HodgkinHuxley& p, double step_ms) {
  const auto real = [](double value) { return static_cast<Real>(value); };
  const double leak = p.leak_reversal_mV();
  shared_exponential = can_share(p, leak);
  V_rest = real(p.V_rest);
  threshold = real(p.spike_threshold_mV);
  threshold_mV = p.spike_threshold_mV;

  const double slope = p.alpha_n.slope_mV;
  double term = 1.0;
  for (int k = 0; k < kTerms; ++k) {
    b_series[k] = real(term);
    term *= -1.0 / (72.0 * slope * (k + 1));
  }
  offset = real(p.V_rest + kCentre_mV);
  const auto linoid = [&](const LinoidRate& rate, Real& at_centre, Real& per_mV, Real& border,
                          Real& inverse, Real& e, Real& full_rate) {
    const double per_step = rate.rate_per_ms * step_ms;
    const double x_at_centre = (rate.shift_mV - kCentre_mV) / rate.slope_mV;
    at_centre = real(per_step * x_at_centre);
    per_mV = real(-per_step / rate.slope_mV);
    border = real(per_step * kLinoidBorder<Real>);
    inverse = real(1.0 / per_step);
    e = real(portable_exp(x_at_centre));
    full_rate = real(per_step);
  };
  linoid(p.alpha_n, p_n_at_centre, p_n_slope, p_n_border, inverse_p_n, e_n, alpha_n_rate);
  linoid(p.alpha_m, p_m_at_centre, p_m_slope, p_m_border, inverse_p_m, e_m, alpha_m_rate);
  e_h = real(portable_exp((p.beta_h.shift_mV - kCentre_mV) / slope));
  const auto decaying = [&](const ExponentialRate& rate, Real& at_centre, Real& at_rest,
                            Real& inverse) {
    at_rest = real(rate.rate_per_ms * step_ms);
    at_centre = real(rate.rate_per_ms * step_ms * portable_exp(-kCentre_mV / rate.slope_mV));
    inverse = real(1.0 / rate.slope_mV);
  };
  decaying(p.beta_n, beta_n, beta_n_rate, beta_n_inverse);
  decaying(p.beta_m, beta_m, beta_m_rate, beta_m_inverse);
  decaying(p.alpha_h, alpha_h, alpha_h_rate, alpha_h_inverse);
  beta_h_rate = real(p.beta_h.rate_per_ms * step_ms);

  n_shift = real(p.V_rest + p.alpha_n.shift_mV);
  m_shift = real(p.V_rest + p.alpha_m.shift_mV);
  h_shift = real(p.V_rest + p.beta_h.shift_mV);
  n_inverse = real(1.0 / p.alpha_n.slope_mV);
  m_inverse = real(1.0 / p.alpha_m.slope_mV);
  h_inverse = real(1.0 / p.beta_h.slope_mV);

  g_L = real(p.g_L);
  g_K = real(p.g_K);
  g_Na = real(p.g_Na);
  g_Ca = real(p.g_CaL);
  gE_L = real(p.g_L * leak);
  gE_K = real(p.g_K * p.E_K);
  gE_Na = real(p.g_Na * p.E_Na);
  gE_Ca = real(p.g_CaL * p.E_Ca);
  capacitance_per_step = real(p.capacitance_uF_per_cm2 / step_ms);
  const Gates rest = p.steady_gates(p.V_rest);
  rest_n = real(rest.n);
  rest_m = real(rest.m);
  rest_h = real(rest.h);
}

template struct NeuronConstants<double>;
template struct NeuronConstants<float>;

}  // namespace merkel
