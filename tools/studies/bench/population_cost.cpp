#include "tools/studies/bench/population_cost.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include "core/units.hpp"

namespace merkel {

Measurement neuron_step_cost(const PopulationCase& which, int runs, double run_s) {
  constexpr int kSteps = 40;
  std::optional<LatticeCoupling> network;
  if (which.coupled) {
    // The most square grid for this number of neurons.
    int rows = static_cast<int>(std::sqrt(static_cast<double>(which.neurons)));
    while (static_cast<int>(which.neurons) % rows != 0) --rows;
    network = *LatticeCoupling::create({}, static_cast<int>(which.neurons) / rows, rows);
  }
  HodgkinHuxleyGroup population({.method = which.method,
                                 .precision = which.precision,
                                 .step = units::nanoseconds_from_us(which.step_us),
                                 .freeze_resting = false},
                                which.neurons, network);
  std::vector<double> current(which.neurons);
  for (std::size_t i = 0; i < current.size(); ++i) {
    current[i] = 8.0 + 6.0 * static_cast<double>(i) / static_cast<double>(current.size());
  }
  SpikeBuffer spikes(4 * which.neurons);
  const auto tick = [&] {
    spikes.clear();
    population.advance(current, current, kSteps, std::chrono::nanoseconds{0}, spikes, which.team);
  };
  for (int k = 0; k < 5; ++k) tick();
  Measurement measured = measure(tick, runs, run_s);
  const double neuron_steps = kSteps * static_cast<double>(which.neurons);
  measured.median_s /= neuron_steps;
  measured.least_s /= neuron_steps;
  return measured;
}

double port_bound_s(Precision precision, double fma_peak_gflops) {
  struct Count {
    Precision precision;
    double multiplications;  ///< per step of a vector
  };
  constexpr Count kCounts[] = {
#include "tools/studies/bench/port_bound.inc"
  };
  for (const Count& count : kCounts) {
    if (count.precision == precision) return 2e-9 * count.multiplications / fma_peak_gflops;
  }
  return 0.0;
}

}  // namespace merkel
