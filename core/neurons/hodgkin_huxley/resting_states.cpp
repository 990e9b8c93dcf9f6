#include "core/neurons/hodgkin_huxley/resting_states.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace merkel {
namespace {

constexpr int kStates = 1024;
constexpr double kBelow_mV = 15.0;   ///< how far below V_r the table begins
constexpr double kAbove_mV = 200.0;  ///< how far above V_r it ends at most
constexpr double kScan_mV = 0.1;

/// The current that holds the membrane at a potential with its steady gates.
double holding_current(const HodgkinHuxley& neuron, double leak_mV, double V) {
  const auto open = neuron.channels(neuron.steady_gates(V), leak_mV);
  return open.conductance * V - open.driven;
}

/// The largest real part of the eigenvalues of the linearised neuron at a fixed point, 1/ms.
double growth_rate(const HodgkinHuxley& neuron, double leak_mV, double V, double current) {
  const auto slope = [&](const Eigen::Vector4d& x) {
    const GateRates k = neuron.rates(x[0]);
    const auto open = neuron.channels({x[1], x[2], x[3]}, leak_mV);
    return Eigen::Vector4d(
        (open.driven - open.conductance * x[0] + current) / neuron.capacitance_uF_per_cm2,
        k.alpha.n * (1.0 - x[1]) - k.beta.n * x[1], k.alpha.m * (1.0 - x[2]) - k.beta.m * x[2],
        k.alpha.h * (1.0 - x[3]) - k.beta.h * x[3]);
  };
  const Gates gates = neuron.steady_gates(V);
  const Eigen::Vector4d point(V, gates.n, gates.m, gates.h);
  Eigen::Matrix4d jacobian;
  for (int j = 0; j < 4; ++j) {
    Eigen::Vector4d offset = Eigen::Vector4d::Zero();
    offset[j] = 1e-5;
    jacobian.col(j) = (slope(point + offset) - slope(point - offset)) / 2e-5;
  }
  return jacobian.eigenvalues().real().maxCoeff();
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
    if (!(growth_rate(neuron, leak, at, current) <= -0.01)) break;
    V.push_back(at);
    I.push_back(current);
  }
  if (I.size() < 2) return;  // no current has a stable rest
  lowest_ = I.front();
  highest_ = I.back();
  spacing_ = (highest_ - lowest_) / (kStates - 1);
  for (int k = 0; k < kStates; ++k) {
    const double wanted = lowest_ + k * spacing_;
    // Bisect the interval of V that contains the current.
    const auto above =
        std::clamp<std::ptrdiff_t>(std::upper_bound(I.begin(), I.end(), wanted) - I.begin(), 1,
                                   static_cast<std::ptrdiff_t>(I.size()) - 1);
    double low = V[static_cast<std::size_t>(above - 1)];
    double high = V[static_cast<std::size_t>(above)];
    for (int halving = 0; halving < 40; ++halving) {
      const double middle = 0.5 * (low + high);
      (holding_current(neuron, leak, middle) < wanted ? low : high) = middle;
    }
    states_.push_back({.V = high, .gates = neuron.steady_gates(high)});
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
