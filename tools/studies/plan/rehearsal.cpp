#include "tools/studies/plan/rehearsal.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "core/parameters/range.hpp"
#include "drivers/probes/limited_probe.hpp"
#include "drivers/probes/open_probe.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/input/probe_queue.hpp"
#include "tools/scene/prepared_run.hpp"

namespace merkel {
namespace {

constexpr std::chrono::seconds kMaxSilence{60};
constexpr std::chrono::milliseconds kBeforeTouch{20};

/// Simulates what a device would send: the channels that its URI states, or else force and depth.
/// The force is about that of the depth in the presets.
std::string stand_in_for(const Scene& scene, std::size_t probe, const DeviceUri& device) {
  const TaxelArray* const taxels = scene.model.indenters[probe].taxels();
  if (taxels == nullptr) {
    switch (stated_channels(device) & (ProbeSample::kForce | ProbeSample::kDepth)) {
      case ProbeSample::kForce:
        return "sim:ramp?force_N=0.45";
      case ProbeSample::kDepth:
        return "sim:ramp?depth_mm=1.5";
      default:
        return "sim:ramp?force_N=0.45&depth_mm=1.5";
    }
  }
  const std::string count = std::to_string(taxels->size());
  return taxels->listed.empty() ? "sim:pad?columns=" + std::to_string(taxels->columns) +
                                      "&rows=" + std::to_string(taxels->rows) +
                                      "&pitch_mm=" + shortest_decimal(taxels->pitch_mm)
                                : "sim:pad?rows=1&columns=" + count;
}

}  // namespace

/// The samples of a probe up to `most` after its first touch.
Expected<std::vector<ProbeRecording::Recorded>, SetupError> ProbeRecording::samples_of(
    Probe& probe, const ContactDecision::Parameters& parameters, std::chrono::nanoseconds most) {
  ContactDecision contact(parameters, true);
  std::vector<Recorded> all;
  Readings readings = probe.readings();
  std::optional<std::chrono::nanoseconds> touched;
  for (;;) {
    const auto count = probe.read(readings, std::chrono::milliseconds{50});
    if (!count && count.error() == ProbeError::kBadData) return bad_input(probe.error_message());
    if (!count) return all;
    for (std::size_t i = 0; i < *count; ++i) {
      auto sample = readings.sample(i);
      if (!sample) continue;
      contact.decide(*sample);
      Recorded& recorded = all.emplace_back(Recorded{.sample = *sample});
      for (const double kPa : readings.taxels(i)) {
        recorded.taxels.push_back(static_cast<float>(kPa));
      }
      if (!touched && touches(*sample)) touched = sample->time;
      const auto end = touched ? *touched + most : all.front().sample.time + kMaxSilence;
      if (sample->time > end) return all;
    }
  }
}

Expected<ProbeRecording, SetupError> ProbeRecording::read(Scene& scene,
                                                          std::chrono::nanoseconds most) {
  ProbeRecording recording;
  std::vector<std::unique_ptr<Probe>> probes;
  std::vector<ProbeInfo> infos;
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    const std::string uri = scene.uri_of(i);
    auto source = scene.source_of(i);
    const bool device = !uri.starts_with("replay:") && !uri.starts_with("sim:");
    if (source && device) {
      recording.stand_in_ = true;
      source = DeviceUri::parse(stand_in_for(scene, i, *source));
    }
    if (!source) return Unexpected<SetupError>(source.error());
    auto probe = open_device(*source);
    if (!probe) return Unexpected<SetupError>(probe.error());
    infos.push_back((*probe)->info());
    infos.back().uri = uri;
    if (!device) {
      *probe =
          std::make_unique<LimitedProbe>(std::move(*probe), std::vector{scene.probes[i].limits});
    }
    probes.push_back(std::move(*probe));
  }
  if (auto chosen = choose_controls(scene, infos); !chosen) {
    return Unexpected<SetupError>(chosen.error());
  }
  auto first = std::chrono::nanoseconds::max();
  auto touch = std::chrono::nanoseconds::max();
  for (std::size_t i = 0; i < probes.size(); ++i) {
    auto read = samples_of(*probes[i], scene.probes[i].input.contact, most);
    if (!read) return Unexpected<SetupError>(read.error());
    const auto& samples = recording.samples_.emplace_back(std::move(*read));
    recording.inputs_.push_back(scene.probes[i].input);
    for (const Recorded& each : samples) {
      if (touches(each.sample)) touch = std::min(touch, each.sample.time - kBeforeTouch);
    }
    if (samples.empty()) continue;
    first = std::min(first, samples.front().sample.time);
    recording.end_ = std::max(recording.end_, samples.back().sample.time);
  }
  if (first == std::chrono::nanoseconds::max()) {
    return bad_input("the scene's probes have no samples to plan with");
  }
  if (touch > recording.end_) touch = recording.end_ - std::min(recording.end_, most);  // never
  const auto before = std::max(touch - first, std::chrono::nanoseconds{0});
  recording.start_ = first + before / scene.model.tick * scene.model.tick;
  recording.end_ = std::min(recording.end_, recording.start_ + most);
  if (recording.end_ - recording.start_ < scene.model.tick) {
    return bad_input("the scene's probes have no samples to plan with");
  }
  return recording;
}

Rehearsal ProbeRecording::at(std::chrono::nanoseconds tick) const {
  std::vector<std::unique_ptr<ProbeQueue>> channels;
  std::vector<ProbeInput> inputs;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const std::size_t taxels = samples_[i].empty() ? 0 : samples_[i].front().taxels.size();
    auto& channel =
        channels.emplace_back(std::make_unique<ProbeQueue>(samples_[i].size() + 1, taxels));
    for (const Recorded& each : samples_[i]) {
      static_cast<void>(channel->try_push(each.sample, each.taxels));
    }
    channel->ended.store(true);
    inputs.emplace_back(*channel, inputs_[i]);
  }
  Rehearsal rehearsal;
  rehearsal.tick = tick;
  for (auto time = start_ + tick; time <= end_; time += tick) {
    Rehearsal::Tick made;
    bool touched = false;
    for (ProbeInput& input : inputs) {
      const ProbeInput::Reading reading = input.at(time);
      made.contacts.push_back(reading.contact);
      touched = touched || reading.touch == Touch::kTouching;
      made.taxels.emplace_back(input.taxels().begin(), input.taxels().end());
    }
    rehearsal.untouched += touched ? 0 : 1;
    rehearsal.ticks.push_back(std::move(made));
  }
  return rehearsal;
}

std::span<SpikeEvent> step(TactileModel& model, const Rehearsal::Tick& tick,
                           std::chrono::nanoseconds start) {
  for (std::size_t i = 0; i < tick.taxels.size(); ++i) {
    if (!tick.taxels[i].empty()) model.set_taxels(i, tick.taxels[i]);
  }
  return model.step(tick.contacts, start);
}

std::vector<SpikeEvent> run_through(TactileModel& model, const Rehearsal& rehearsal) {
  model.reset();
  std::vector<SpikeEvent> spikes;
  std::chrono::nanoseconds time{0};
  for (const Rehearsal::Tick& tick : rehearsal.ticks) {
    const auto made = step(model, tick, time);
    spikes.insert(spikes.end(), made.begin(), made.end());
    time += model.parameters().tick;
  }
  return spikes;
}

}  // namespace merkel
