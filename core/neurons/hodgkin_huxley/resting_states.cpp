#include "core/neurons/hodgkin_huxley/resting_states.hpp"

#include <algorithm>
#include <array>

namespace merkel {
namespace {

constexpr int kStates = 1024;
constexpr double kBelow_mV = 15.0;   ///< how far below V_r the table begins
constexpr double kAbove_mV = 200.0;  ///< how far above V_r it ends at most
constexpr double kScan_mV = 0.1;
constexpr int kSecants = 4;  ///< each leaves a hundredth of the error, or less

/// The current that holds the membrane at a potential with its steady gates.
double holding_current(const HodgkinHuxley& neuron, double leak_mV, double V) {
  const auto open = neuron.channels(neuron.steady_gates(V), leak_mV);
  return open.conductance * V - open.driven;
}

/// Whether every disturbance of the neuron at a fixed point decays faster than at `rate`, 1/ms: all
/// eigenvalues λ of the linearised neuron have a real part below −rate.
///
/// A gate follows the potential and itself, not the other gates. So with x = λ + rate, the λ are
/// the roots of (x + own)·Π(x + decayᵢ) − Σ loopᵢ·Π(x + decayⱼ), j ≠ i: a polynomial x⁴ + a1·x³ +
/// a2·x² + a3·x + a4, judged by the criterion of Routh and Hurwitz.
bool settles(const HodgkinHuxley& neuron, double leak_mV, double V, double rate) {
  constexpr double kStep = 1e-5;
  const Gates gates = neuron.steady_gates(V);
  const auto pull = [&](const Gates& x) {  // V̇ without the current, which is constant
    const auto open = neuron.channels(x, leak_mV);
    return (open.driven - open.conductance * V) / neuron.capacitance_uF_per_cm2;
  };
  const GateRates at = neuron.rates(V);
  const GateRates above = neuron.rates(V + kStep);
  const GateRates below = neuron.rates(V - kStep);
  std::array<double, 3> decay{};  // of a gate at constant potential, less `rate`
  std::array<double, 3> loop{};   // from the potential to a gate and back
  std::size_t gate = 0;
  for (double Gates::*const x : {&Gates::n, &Gates::m, &Gates::h}) {
    Gates more = gates;
    Gates less = gates;
    more.*x += kStep;
    less.*x -= kStep;
    const double follows = ((above.alpha.*x - below.alpha.*x) * (1.0 - gates.*x) -
                            (above.beta.*x - below.beta.*x) * gates.*x) /
                           (2.0 * kStep);
    decay[gate] = at.alpha.*x + at.beta.*x - rate;
    loop[gate] = follows * (pull(more) - pull(less)) / (2.0 * kStep);
    ++gate;
  }
  // Π(x + decayᵢ) = x³ + square·x² + linear·x + constant.
  const auto& [p, q, r] = decay;
  const double square = p + q + r;
  const double linear = p * q + q * r + r * p;
  const double constant = p * q * r;
  const double own =
      neuron.channels(gates, leak_mV).conductance / neuron.capacitance_uF_per_cm2 - rate;
  const double a1 = own + square;
  const double a2 = own * square + linear - (loop[0] + loop[1] + loop[2]);
  const double a3 =
      own * linear + constant - loop[0] * (q + r) - loop[1] * (r + p) - loop[2] * (p + q);
  const double a4 = own * constant - loop[0] * q * r - loop[1] * r * p - loop[2] * p * q;
  return a1 > 0.0 && a3 > 0.0 && a4 > 0.0 && a1 * a2 * a3 > a3 * a3 + a1 * a1 * a4;
}

}  // namespace

RestingStates::RestingStates(const HodgkinHuxley& neuron) {
  const double leak = neuron.leak_reversal_mV();
  std::vector<double> V;
  std::vector<double> I;
  const double highest = neuron.V_rest + kAbove_mV;
  for (double at = neuron.V_rest - kBelow_mV; at < highest; at += kScan_mV) {
    const double current = holding_current(neuron, leak, at);
    // The table ends where the fixed point is not clearly stable or not unique.
    if (!I.empty() && !(current > I.back())) break;
    if (!settles(neuron, leak, at, 0.01)) break;
    V.push_back(at);
    I.push_back(current);
  }
  if (I.size() < 2) return;  // no current has a stable rest
  lowest_ = I.front();
  highest_ = I.back();
  spacing_ = (highest_ - lowest_) / (kStates - 1);
  for (int k = 0; k < kStates; ++k) {
    const double wanted = lowest_ + k * spacing_;
    // In the interval of V that contains the current, nearly a straight line.
    const auto above =
        std::clamp<std::ptrdiff_t>(std::upper_bound(I.begin(), I.end(), wanted) - I.begin(), 1,
                                   static_cast<std::ptrdiff_t>(I.size()) - 1);
    const auto upper = static_cast<std::size_t>(above);
    double low = V[upper - 1];
    double high = V[upper];
    double missing = I[upper - 1] - wanted;
    double spare = I[upper] - wanted;
    double at = low;
    for (int pass = 0; pass < kSecants && spare > missing; ++pass) {
      at = low - missing * (high - low) / (spare - missing);
      const double off = holding_current(neuron, leak, at) - wanted;
      (off < 0.0 ? low : high) = at;
      (off < 0.0 ? missing : spare) = off;
    }
    states_.push_back({.V = at, .gates = neuron.steady_gates(at)});
  }
}

RestingStates::State RestingStates::at(double current) const noexcept {
  const double place = (current - lowest_) / spacing_;
  const auto below = std::min(static_cast<std::size_t>(place), states_.size() - 2);
  const double t = place - static_cast<double>(below);
  const State& a = states_[below];
  const State& b = states_[below + 1];
  const auto between = [t](double x, double y) { return x + (y - x) * t; };
  return {.V = between(a.V, b.V),
          .gates = {.n = between(a.gates.n, b.gates.n),
                    .m = between(a.gates.m, b.gates.m),
                    .h = between(a.gates.h, b.gates.h)}};
}

}  // namespace merkel
