#include "core/neurons/hodgkin_huxley/driven_neurons.hpp"

#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace merkel {

DrivenNeurons drive_neurons(const std::vector<double>& current, double duration_ms,
                            IntegrationMethod method, Precision precision, double step_us,
                            const std::optional<LatticeCoupling>& network,
                            const HodgkinHuxley& neuron) {
  const auto step = units::nanoseconds_from_us(step_us);
  HodgkinHuxleyGroup population({.neuron = neuron,
                                 .method = method,
                                 .precision = precision,
                                 .step = step,
                                 .freeze_resting = false},
                                current.size(), network);
  // A call spans a few milliseconds, in which a neuron fires at most once.
  const int steps_a_call = std::max(1, static_cast<int>(2000.0 / step_us));
  const auto steps = static_cast<int>(1e3 * duration_ms / step_us);
  SpikeBuffer spikes(current.size() * static_cast<std::size_t>(steps_a_call + 1));
  DrivenNeurons driven;
  for (int done = 0; done < steps;) {
    const int now = std::min(steps_a_call, steps - done);
    spikes.clear();
    population.advance(current, current, now, done * step, spikes);
    driven.spikes.insert(driven.spikes.end(), spikes.events().begin(), spikes.events().end());
    driven.resets += population.resets().size();
    done += now;
  }
  std::stable_sort(driven.spikes.begin(), driven.spikes.end());
  return driven;
}

}  // namespace merkel
