// What does a step of a neuron cost, by method, precision and number of neurons?
#include <vector>

#include <benchmark/benchmark.h>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"

namespace merkel {
namespace {

void membrane_steps(benchmark::State& state) {
  const auto method = static_cast<IntegrationMethod>(state.range(0));
  const auto precision = static_cast<Precision>(state.range(1));
  const auto neurons = static_cast<std::size_t>(state.range(2));
  HodgkinHuxleyGroup population({.method = method, .precision = precision, .freeze_resting = false},
                                neurons, std::nullopt);
  std::vector<double> current(neurons);
  for (std::size_t i = 0; i < neurons; ++i) {
    current[i] = 8.0 + 6.0 * static_cast<double>(i) / static_cast<double>(neurons);
  }
  SpikeBuffer spikes(4 * neurons);
  constexpr int kSteps = 40;
  for (auto _ : state) {
    spikes.clear();
    population.advance(current, current, kSteps, std::chrono::nanoseconds{0}, spikes);
  }
  state.SetItemsProcessed(state.iterations() * kSteps * state.range(2));
  state.SetLabel(std::string(name_of(method)) + " " + std::string(name_of(precision)));
}
BENCHMARK(membrane_steps)->ArgsProduct({benchmark::CreateDenseRange(0, 6, 1), {0, 1}, {20, 2000}});

}  // namespace
}  // namespace merkel
