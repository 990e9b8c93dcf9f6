// What does encoding cost a tick, for 16 electrodes over 450 afferents?
#include <vector>

#include <benchmark/benchmark.h>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/math/random.hpp"

namespace merkel {
namespace {

/// A 4 by 4 array of electrodes, with all encoders, over 450 afferents on a grid.
EncodingParameters electrodes(std::int64_t encoder) {
  EncodingParameters parameters;
  for (int i = 0; i < 16; ++i) {
    Electrode electrode{.name = "E" + std::to_string(i + 1)};
    electrode.field_mm = {3.75 + 7.5 * (i % 4), 2.5 + 5.0 * (i / 4), 3.5};
    electrode.encoder = static_cast<EncoderKind>(encoder < 5 ? encoder : i % 5);
    electrode.amplitude_uA = {20.0, 80.0};
    electrode.frequency_Hz = {0.0, 200.0};
    parameters.electrodes.push_back(electrode);
  }
  parameters.stimulation.max_charge_nC = 16.0;
  parameters.stimulation.max_total_uA = 400.0;
  parameters.stimulation.watchdog = std::chrono::milliseconds{100};
  parameters.stimulation.max_slope_uA_per_s = 5000.0;
  return parameters;
}

EncodedModel afferents() {
  EncodedModel model{.patches = {{.area = {}, .afferents = {}}}, .patch_of_probe = {0}};
  for (int n = 0; n < 450; ++n) {
    model.patches[0].afferents.push_back(
        {.x_mm = 0.6 + 1.2 * (n % 25), .y_mm = 0.55 + 1.1 * (n / 25), .receptors = 1});
  }
  return model;
}

/// \param state  encoder (5: all kinds), spikes in a tick of 1 ms
void encode_tick(benchmark::State& state) {
  auto encoder = *StimulationEncoder::create(electrodes(state.range(0)), afferents());
  const auto count = static_cast<std::size_t>(state.range(1));
  Random random(1);
  std::vector<SpikeEvent> spikes(count);
  for (std::size_t i = 0; i < count; ++i) {
    spikes[i].neuron = static_cast<std::uint32_t>(1 + random.next() % 450);
  }
  const Press press{.contact = {.depth_mm = 1.0, .force_mN = 500.0, .contact_radius_mm = 1.5},
                    .x_mm = 15.0,
                    .y_mm = 10.0};
  TickRecord record;
  for (auto _ : state) {
    for (std::size_t i = 0; i < count; ++i) {
      spikes[i].time = record.time + std::chrono::nanoseconds{(i + 1) * 1'000'000 / (count + 1)};
    }
    record.time += std::chrono::milliseconds{1};
    benchmark::DoNotOptimize(
        encoder.step({.records = {&record, 1}, .presses = {&press, 1}, .spikes = spikes}).data());
  }
}
BENCHMARK(encode_tick)
    ->ArgNames({"encoder", "spikes"})
    ->ArgsProduct({{0, 1, 2, 3, 4, 5}, {0, 10, 45}});

}  // namespace
}  // namespace merkel
