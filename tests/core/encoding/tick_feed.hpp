#pragma once

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/records/sent_command.hpp"

namespace merkel {

/// The tick of the tests.
inline constexpr std::chrono::milliseconds kTick{1};

[[nodiscard]] inline std::vector<StimulationCommand> commands_of(
    std::span<const SentCommand> sent) {
  std::vector<StimulationCommand> commands;
  for (const SentCommand& each : sent) commands.push_back(each.command);
  return commands;
}

/// Feeds an encoder with synthetic ticks of one patch and one probe.
class TickFeed {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  TickFeed(StimulationEncoder& encoder, Nanoseconds tick, Nanoseconds start = {})
      : encoder_(encoder), tick_(tick), end_(start) {}

  std::span<const StimulationCommand> step() {
    end_ += tick_;
    const TickRecord record{
        .time = end_, .number = ++number_, .probe = 0, .state = state, .doubts = doubts};
    const auto commands = encoder_.step(
        {.records = {&record, 1}, .presses = {&press, 1}, .spikes = spikes, .resets = resets});
    spikes.clear();
    resets.clear();
    return commands;
  }
  /// Skips ticks.
  void skip(int ticks) { end_ += ticks * tick_; }
  void spike(Nanoseconds after_begin, std::uint32_t neuron) {
    spikes.push_back({.time = end_ + after_begin, .neuron = neuron});
  }
  [[nodiscard]] Nanoseconds now() const { return end_; }

  Press press;
  TickRecord::State state = TickRecord::State::kFollowing;
  std::uint8_t doubts = 0;
  std::vector<SpikeEvent> spikes;
  std::vector<SpikeEvent> resets;

 private:
  StimulationEncoder& encoder_;
  Nanoseconds tick_;
  Nanoseconds end_;
  std::uint64_t number_ = 0;
};

/// A patch whose afferents lie on a grid of 1 mm, 30 by 20, numbered along x.
inline EncodedModel grid_model(std::chrono::nanoseconds tick = std::chrono::milliseconds{1}) {
  EncodedModel model{
      .tick = tick, .patches = {{.area = {}, .afferents = {}}}, .patch_of_probe = {0}};
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 30; ++x) {
      model.patches[0].afferents.push_back({.x_mm = x + 0.5, .y_mm = y + 0.5, .receptors = 1});
    }
  }
  return model;
}

/// Two such patches, and a probe on each.
inline EncodedModel two_patch_model() {
  EncodedModel model = grid_model();
  model.patches.push_back(model.patches[0]);
  model.patch_of_probe = {0, 1};
  return model;
}

inline Electrode electrode_at(const std::string& name, EncoderKind encoder, double x_mm,
                              double y_mm, double radius_mm) {
  Electrode electrode{.name = name};
  electrode.field_mm = {x_mm, y_mm, radius_mm};
  electrode.encoder = encoder;
  electrode.amplitude_uA = {20.0, 80.0};
  electrode.frequency_Hz = {0.0, 200.0};
  return electrode;
}

inline EncodingParameters encoding_of(std::vector<Electrode> electrodes) {
  EncodingParameters parameters{.electrodes = std::move(electrodes), .stimulation = {}};
  parameters.stimulation.max_charge_nC = 16.0;
  parameters.stimulation.max_total_uA = 1e5;
  parameters.stimulation.watchdog = std::chrono::milliseconds{100};
  return parameters;
}

}  // namespace merkel
