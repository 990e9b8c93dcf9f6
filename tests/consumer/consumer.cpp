// An independent program: presses with a simulated probe, polls the spikes from a queue, and also
// receives them by a callback. It includes public headers only.
#include <cstdio>
#include <thread>

#include <merkel/open_probe.hpp>
#include <merkel/pipeline.hpp>
#include <merkel/spike_callback.hpp>
#include <merkel/tactile_model.hpp>

int main() {
  auto model = merkel::TactileModel::create({});
  auto probe = merkel::open_probe("sim:ramp?depth_mm=1.5&hold_s=0.5");
  if (!model || !probe) return 1;

  merkel::Pipeline pipeline(*model, {.fast = true});
  pipeline.add_probe(std::move(*probe), {.x_mm = 15.0, .y_mm = 10.0});
  unsigned called = 0;  // on the callback's thread
  pipeline.add_sink(std::make_unique<merkel::SpikeCallback>(
      "encoder", [&](std::span<const merkel::SpikeEvent> spikes) { called += spikes.size(); }));
  merkel::SpikeChannel& channel = pipeline.add_consumer(4096);
  unsigned polled = 0;
  std::jthread poller([&] {
    for (bool ended = false; !ended;) {
      ended = channel.ended.load();  // read before the last look into the queue
      for (merkel::SpikeEvent spike; channel.spikes.try_pop(spike);) ++polled;
    }
  });
  const auto report = pipeline.run();
  poller.join();
  std::printf("%u spikes polled, %u called\n", polled, called);
  return report && polled > 0 && report->spikes == polled && called == polled ? 0 : 1;
}
