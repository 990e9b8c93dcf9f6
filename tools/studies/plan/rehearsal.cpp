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

/// The samples of a probe until `most` after its first touch.
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

Expected<Rehearsal, SetupError> rehearse(Scene& scene, std::chrono::nanoseconds most) {
  Rehearsal rehearsal;
  std::vector<std::unique_ptr<ProbeChannel>> channels;
  std::vector<ProbeInput> inputs;
  std::chrono::nanoseconds start = std::chrono::nanoseconds::max();
  std::chrono::nanoseconds end{0};
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    const std::string& uri = scene.probes[i].uri;
    const bool recorded = uri.starts_with("replay:") || uri.starts_with("sim:");
    rehearsal.stand_in = rehearsal.stand_in || !recorded;
    auto probe = open_probe(recorded ? uri : "sim:ramp");
    if (!probe) return Unexpected<SetupError>(probe.error());
    const bool depth = ((*probe)->info().channels & ProbeSample::kDepth) != 0U;
    scene.model.indenters[i].control = scene.probes[i].control.value_or(
        depth ? Indenter::Control::kDepth : Indenter::Control::kForce);
    const std::vector<ProbeSample> samples = read_samples(**probe, most);
    auto& channel = channels.emplace_back(std::make_unique<ProbeChannel>(samples.size() + 1));
    for (const ProbeSample& sample : samples) {
      static_cast<void>(channel->samples.try_push(sample));
      if (touches(sample)) start = std::min(start, sample.time - kBeforeTouch);
    }
    channel->ended.store(true);
    if (!samples.empty()) end = std::max(end, samples.back().time);
    inputs.emplace_back(*channel, scene.probes[i].input);
  }
  if (start > end) start = end - std::min(end, most);  // nothing is ever touched
  const auto tick = scene.model.tick;
  for (auto time = start + tick; time <= std::min(end, start + most); time += tick) {
    std::vector<ContactInput> contacts;
    for (ProbeInput& input : inputs) contacts.push_back(input.at(time).contact);
    const bool touched = std::any_of(contacts.begin(), contacts.end(), [](const ContactInput& c) {
      return c.depth_mm > 0.0 || c.force_mN > 0.0;
    });
    rehearsal.untouched += touched ? 0 : 1;
    rehearsal.ticks.push_back(std::move(contacts));
  }
  if (rehearsal.ticks.empty()) return bad_input("the scene's probes give nothing to plan with");
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
