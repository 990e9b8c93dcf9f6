#include "core/neurons/hodgkin_huxley/largest_step.hpp"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "core/neurons/hodgkin_huxley/driven_neurons.hpp"

namespace merkel {
namespace {

struct Limit {
  double published_ms;  ///< largest step of the published neuron, measured (`merkel chart`)
  /// How much a method may lose to the neighbours in a step; 0: it cannot diverge.
  double interval = 0.0;
};

Limit limit_of(IntegrationMethod method) noexcept {
  switch (method) {
    case IntegrationMethod::kForwardEuler:
    case IntegrationMethod::kHeun:
      return {.published_ms = 0.055, .interval = 2.0};
    case IntegrationMethod::kRk4:
      return {.published_ms = 0.08, .interval = 2.785};
    case IntegrationMethod::kStaggeredMultistep:
      // Neighbours are extrapolated, the outflow is implicit: measured on the lattice.
      return {.published_ms = 0.0625, .interval = 0.5};
    case IntegrationMethod::kExponentialEuler:
      return {.published_ms = 0.055};
    case IntegrationMethod::kBackwardEuler:
    case IntegrationMethod::kRushLarsen:
    case IntegrationMethod::kCrankNicolson:
      return {.published_ms = 0.125};
  }
  return {.published_ms = 0.0};
}

constexpr std::size_t kCurrents = 16;
constexpr double kLargestCurrent = 50.0;
constexpr double kDuration_ms = 100.0;
constexpr double kExact_us = 5.0;
constexpr double kLeast_us = 1.0;
constexpr double kSmaller = 0.8;

/// The spikes of each neuron; empty if a state became non-finite.
std::vector<int> spike_counts(const HodgkinHuxley& neuron, IntegrationMethod method,
                              double step_us) {
  std::vector<double> currents(kCurrents);
  for (std::size_t i = 0; i < kCurrents; ++i) {
    currents[i] = kLargestCurrent * static_cast<double>(i) / (kCurrents - 1);
  }
  const DrivenNeurons driven =
      drive_neurons(currents, kDuration_ms, method, Precision::kDouble, step_us, {}, neuron);
  if (driven.resets > 0) return {};
  std::vector<int> counts(kCurrents);
  for (const SpikeEvent& spike : driven.spikes) ++counts[spike.neuron - 1];
  return counts;
}

/// One spike more or less may lie at the end; one neuron may be at the limit of firing.
bool agree(const std::vector<int>& counts, const std::vector<int>& exact) {
  int wrong = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (std::abs(counts[i] - exact[i]) > 1 + exact[i] / 10) ++wrong;
  }
  return !counts.empty() && wrong <= 1;
}

}  // namespace

double largest_step_alone_ms(const HodgkinHuxley& neuron, IntegrationMethod method) {
  const double published_ms = limit_of(method).published_ms;
  if (neuron == HodgkinHuxley{}) return published_ms;
  const auto exact = spike_counts(neuron, IntegrationMethod::kCrankNicolson, kExact_us);
  if (exact.empty()) return 0.0;
  for (double step_us = 1e3 * published_ms; step_us >= kLeast_us; step_us *= kSmaller) {
    if (agree(spike_counts(neuron, method, step_us), exact)) return 1e-3 * step_us;
  }
  return 0.0;
}

double largest_step_ms(IntegrationMethod method, double alone_ms, double exchange_per_ms) noexcept {
  if (!(exchange_per_ms > 0.0)) return alone_ms;
  const double interval = limit_of(method).interval;
  return interval > 0.0 ? 1.0 / (1.0 / alone_ms + 2.0 * exchange_per_ms / interval)
                        : std::min(alone_ms, kLargestExchange / exchange_per_ms);
}

}  // namespace merkel
