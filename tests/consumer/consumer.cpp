// A program of somebody else's: presses with a simulated probe and polls the spikes.
#include <cstdio>
#include <thread>

#include <core/scene/tactile_model.hpp>
#include <drivers/probes/open_probe.hpp>
#include <realtime/pipeline.hpp>

int main() {
  auto model = merkel::TactileModel::create({});
  auto probe = merkel::open_probe("sim:ramp?depth_mm=1.5&hold_s=0.5");
  if (!model || !probe) return 1;

  merkel::Pipeline pipeline(*model, {.fast = true});
  pipeline.add_probe(std::move(*probe), {.x_mm = 15.0, .y_mm = 10.0});
  merkel::SpikeChannel& channel = pipeline.add_consumer(4096);

  int spikes = 0;
  std::jthread encoder([&] {
    for (bool ended = false; !ended;) {
      ended = channel.ended.load();  // read before the last look into the queue
      for (merkel::SpikeEvent spike; channel.spikes.try_pop(spike);) ++spikes;
    }
  });
  const auto report = pipeline.run();
  encoder.join();
  std::printf("%d spikes\n", spikes);
  return report && spikes > 0 && report->spikes == static_cast<unsigned>(spikes) ? 0 : 1;
}
