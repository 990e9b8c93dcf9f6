#pragma once

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"

namespace merkel {

/// The constants of a Hodgkin-Huxley neuron in the precision of the kernel. All rates are per step,
/// so that a gate changes by ẋ·dt = (p − s·x)/D without further factors.
///
/// Slopes of 80, 20, 18 and 10 mV all divide 720 mV: with b = e^{−w/720}, w = u − 45 mV, the
/// exponentials of u/80, u/20, u/18 and u/10 are the powers 9, 36, 40 and 72 of b. Over the range
/// of membrane potentials, b is a short polynomial. For other slopes, or if potentials can leave
/// the range, each exponential is computed separately.
template <class Real>
struct NeuronConstants {
  static constexpr double kCentre_mV = 45.0;                 ///< u at w = 0
  static constexpr double kHalfRange_mV = 90.0;              ///< limit of |w|
  static constexpr int kTerms = sizeof(Real) == 8 ? 10 : 6;  ///< of the polynomial

  NeuronConstants(const HodgkinHuxley& neuron, double step_ms);

  bool shared_exponential;
  Real V_rest;
  Real threshold;
  double threshold_mV;  ///< not rounded to Real: for spike times

  // Shared exponential.
  Real offset;                                              ///< V at w = 0
  Real b_series[kTerms];                                    ///< b = Σ c_k·w^k
  Real p_n_slope, p_n_at_centre, p_m_slope, p_m_at_centre;  ///< p = rate·x = at_centre + slope·w
  Real p_n_border, p_m_border;    ///< below this |p|, eˣ−1 loses digits
  Real inverse_p_n, inverse_p_m;  ///< x = p·inverse
  Real e_n, e_m, e_h;             ///< e^x / b^72, for α_n, α_m and β_h
  Real beta_n, beta_m, alpha_h;   ///< rates / b^9, b^40, b^36

  // Separate exponentials: exponents are (shift − V)·inverse slope; shifts are absolute, mV.
  Real n_shift, n_inverse, m_shift, m_inverse, h_shift, h_inverse;
  Real beta_n_inverse, beta_m_inverse, alpha_h_inverse;
  Real beta_n_rate, beta_m_rate, alpha_h_rate;  ///< at V_r

  Real alpha_n_rate, alpha_m_rate, beta_h_rate;

  Real g_L, g_K, g_Na, g_Ca;
  Real gE_L, gE_K, gE_Na, gE_Ca;
  Real capacitance_per_step;
  Real rest_n, rest_m, rest_h;
};

/// Below this |x|, the kernel divides numerator and denominator of x/(eˣ−1) by x. The limit
/// balances the truncation error of a short series against the loss of digits in eˣ−1.
template <class Real>
inline constexpr double kLinoidBorder = sizeof(Real) == 8 ? 1.0 / 1024 : 1.0 / 8;

extern template struct NeuronConstants<double>;
extern template struct NeuronConstants<float>;

}  // namespace merkel
