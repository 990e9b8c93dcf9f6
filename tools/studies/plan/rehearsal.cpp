#include "tools/studies/plan/rehearsal.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "drivers/probes/open_probe.hpp"
#include "realtime/input/probe_channel.hpp"
#include "realtime/input/probe_input.hpp"

namespace merkel {
namespace {

constexpr std::chrono::seconds kLongestSilence{60};
constexpr std::chrono::milliseconds kBeforeTouch{20};

bool touches(const ProbeSample& sample) { return sample.depth_mm > 0.0 || sample.force_mN > 0.0; }

/// The samples of a probe up to `most` after its first touch.
std::vector<ProbeSample> read_samples(Probe& probe, std::chrono::nanoseconds most) {
  std::vector<ProbeSample> all;
  std::vector<ProbeSample> batch(1024);
  std::optional<std::chrono::nanoseconds> touched;
  for (;;) {
    const auto count = probe.read(batch, std::chrono::milliseconds{50});
    if (!count) return all;
    for (std::size_t i = 0; i < *count; ++i) {
      all.push_back(batch[i]);
      if (!touched && touches(batch[i])) touched = batch[i].time;
      const auto end = touched ? *touched + most : all.front().time + kLongestSilence;
      if (batch[i].time > end) return all;
    }
  }
}

}  // namespace

Expected<ProbeRecording, SetupError> ProbeRecording::read(Scene& scene,
                                                          std::chrono::nanoseconds most) {
  ProbeRecording recording;
  auto first = std::chrono::nanoseconds::max();
  auto touch = std::chrono::nanoseconds::max();
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    const std::string uri = scene.uri_of(i);
    const bool recorded = uri.starts_with("replay:") || uri.starts_with("sim:");
    recording.stand_in_ = recording.stand_in_ || !recorded;
    auto probe = open_probe(recorded ? uri : "sim:ramp");
    if (!probe) return Unexpected<SetupError>(probe.error());
    const bool depth = ((*probe)->info().channels & ProbeSample::kDepth) != 0U;
    scene.model.indenters[i].control = scene.probes[i].control.value_or(
        depth ? Indenter::Control::kDepth : Indenter::Control::kForce);
    const auto& samples = recording.samples_.emplace_back(read_samples(**probe, most));
    recording.inputs_.push_back(scene.probes[i].input);
    for (const ProbeSample& sample : samples) {
      if (touches(sample)) touch = std::min(touch, sample.time - kBeforeTouch);
    }
    if (samples.empty()) continue;
    first = std::min(first, samples.front().time);
    recording.end_ = std::max(recording.end_, samples.back().time);
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
  std::vector<std::unique_ptr<ProbeChannel>> channels;
  std::vector<ProbeInput> inputs;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    auto& channel = channels.emplace_back(std::make_unique<ProbeChannel>(samples_[i].size() + 1));
    for (const ProbeSample& sample : samples_[i]) {
      static_cast<void>(channel->samples.try_push(sample));
    }
    channel->ended.store(true);
    inputs.emplace_back(*channel, inputs_[i]);
  }
  Rehearsal rehearsal;
  rehearsal.tick = tick;
  for (auto time = start_ + tick; time <= end_; time += tick) {
    std::vector<ContactInput> contacts;
    for (ProbeInput& input : inputs) contacts.push_back(input.at(time).contact);
    const bool touched = std::any_of(contacts.begin(), contacts.end(), [](const ContactInput& c) {
      return c.depth_mm > 0.0 || c.force_mN > 0.0;
    });
    rehearsal.untouched += touched ? 0 : 1;
    rehearsal.ticks.push_back(std::move(contacts));
  }
  return rehearsal;
}

std::vector<SpikeEvent> run_through(TactileModel& model, const Rehearsal& rehearsal) {
  model.reset();
  std::vector<SpikeEvent> spikes;
  std::chrono::nanoseconds time{0};
  for (const auto& contacts : rehearsal.ticks) {
    const auto made = model.step(contacts, time);
    spikes.insert(spikes.end(), made.begin(), made.end());
    time += model.parameters().tick;
  }
  return spikes;
}

}  // namespace merkel
