// What does handing a spike from one thread to another cost the one that gives it?
#include <benchmark/benchmark.h>

#include "core/records/spike_event.hpp"
#include "realtime/queues/bounded_queue.hpp"

namespace merkel {
namespace {

void push_and_pop(benchmark::State& state) {
  BoundedQueue<SpikeEvent> queue(1024);
  SpikeEvent spike{.neuron = 1};
  for (auto _ : state) {
    benchmark::DoNotOptimize(queue.try_push(spike));
    benchmark::DoNotOptimize(queue.try_pop(spike));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(push_and_pop);

}  // namespace
}  // namespace merkel
