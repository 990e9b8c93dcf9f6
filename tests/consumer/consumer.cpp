// An independent program: presses with a simulated probe on a preset, polls the spikes from a queue
// and also receives them by a callback; then pushes samples into the model itself. It includes
// public headers only.
#include <cstdio>
#include <thread>

#include <merkel/input_file.hpp>
#include <merkel/pipeline.hpp>
#include <merkel/prepared_run.hpp>
#include <merkel/sample_stream.hpp>
#include <merkel/scene_presets.hpp>
#include <merkel/spike_callback.hpp>

/// Pushes a press into the model, one sample per millisecond. Returns the number of spikes.
std::size_t spikes_of_pushes(const merkel::Scene& scene) {
  auto stream = merkel::SampleStream::create(scene, {merkel::ProbeSample::kDepth});
  if (!stream) return 0;
  std::size_t spikes = 0;
  for (int i = 0; i < 500; ++i) {
    const auto pushed = stream->push(0, {.time = std::chrono::milliseconds{i},
                                         .depth_mm = i < 100 ? 0.015 * i : 1.5,
                                         .channels = merkel::ProbeSample::kDepth});
    spikes += pushed ? pushed->size() : 0;
  }
  return spikes + stream->finish().size();
}

int main() {
  const merkel::ReadFiles inputs;  // no output replaces one of them
  auto scene = merkel::scene_named("paper");
  if (!scene) return 1;
  if (!scene->set_probes({"sim:ramp?depth_mm=1.5&hold_s=0.5"})) return 1;
  auto run = merkel::prepare_run(*scene, {.fast = true});
  if (!run) return 1;

  merkel::Pipeline pipeline(*run->model, run->parameters);
  run->add_probes_to(pipeline);
  unsigned called = 0;  // on the callback's thread
  pipeline.add_sink(std::make_unique<merkel::SpikeCallback>(
      "encoder", [&](std::span<const merkel::SpikeEvent> spikes) { called += spikes.size(); }));
  merkel::SpikeConsumer consumer = pipeline.add_consumer(4096);
  unsigned polled = 0;
  std::jthread poller([&] {
    for (bool ended = false; !ended; consumer.wait()) {
      ended = consumer.ended();  // asked before the last look into the queue
      for (merkel::SpikeEvent spike; consumer.try_pop(spike);) ++polled;
    }
  });
  const auto report = pipeline.run();
  poller.join();
  const std::size_t pushed = spikes_of_pushes(*scene);
  std::printf("%u spikes polled, %u called, %zu pushed\n", polled, called, pushed);
  return report && polled > 0 && report->spikes == polled && called == polled && pushed > 0 ? 0 : 1;
}
