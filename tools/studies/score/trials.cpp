#include "tools/studies/score/trials.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/scene/tactile_patch.hpp"
#include "core/units.hpp"
#include "tools/studies/score/press_trace.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

constexpr double kCentreX_mm = 15.0;
constexpr double kCentreY_mm = 10.0;

/// At least twenty ticks per cycle, and at most half a millisecond.
nanoseconds tick_for(const Stimulus& stimulus) {
  nanoseconds tick = microseconds{500};
  while (stimulus.frequency_hz * units::s_from(tick) > 0.05 && tick > microseconds{50}) tick /= 2;
  return tick;
}

double level_at(const Stimulus& stimulus, double time_s) {
  if (stimulus.trace) return stimulus.trace->at(time_s).level;
  const double held = stimulus.level * std::min(1.0, time_s / stimulus.ramp_s);
  const double since = time_s - stimulus.settle_s;
  if (stimulus.amplitude_mm == 0.0 || since <= 0.0) return held;
  return held +
         stimulus.amplitude_mm * std::sin(2.0 * std::numbers::pi * stimulus.frequency_hz * since);
}

std::size_t count_in(const std::vector<double>& times, double begin, double end) {
  return static_cast<std::size_t>(
      std::count_if(times.begin(), times.end(), [=](double t) { return t >= begin && t < end; }));
}

}  // namespace

TactileModel::Parameters repeated_afferent(const TactileModel::Parameters& scene,
                                           const Stimulus& stimulus, std::size_t trials) {
  TactileModel::Parameters parameters = scene;
  PatchParameters patch = scene.patches.front();
  patch.patch = Patch{};
  patch.layout = ReceptorLayout::kFields;
  patch.field.radius_spread = 0.0;
  patch.centres.assign(trials, {.x_mm = kCentreX_mm, .y_mm = kCentreY_mm});
  parameters.patches = {patch};
  parameters.indenters = {stimulus.indenter};
  parameters.network.gain = 0.0;
  parameters.accuracy.cull_tolerance = 0.0;
  parameters.adaptation.gain_spread = 0.0;
  if (std::isfinite(parameters.skin.radius_mm)) {
    parameters.skin.apex = {.x_mm = kCentreX_mm, .y_mm = kCentreY_mm};
  }
  const nanoseconds tick = tick_for(stimulus);
  parameters.tick = tick;
  if (parameters.step > tick || tick % parameters.step != nanoseconds{0}) {
    parameters.step = std::min(tick, parameters.step);
    while (tick % parameters.step != nanoseconds{0}) parameters.step -= nanoseconds{1};
  }
  return parameters;
}

Expected<Trials, ParameterError> Trials::create(const TactileModel::Parameters& scene,
                                                const Stimulus& stimulus, std::size_t trials) {
  auto model = TactileModel::create(repeated_afferent(scene, stimulus, trials));
  if (!model) return Unexpected<ParameterError>(model.error());
  return Trials(std::move(*model), stimulus);
}

bool Trials::fits(const Stimulus& stimulus) const {
  const Indenter& a = stimulus_.indenter;
  const Indenter& b = stimulus.indenter;
  return a.same_tip(b) && a.control == b.control && tick_for(stimulus_) == tick_for(stimulus);
}

template <class AfterTick>
void Trials::press(const Stimulus& stimulus, AfterTick after_tick) {
  model_.reset();
  const nanoseconds tick = model_.parameters().tick;
  const auto end = units::nanoseconds_from_s(stimulus.end_s());
  ContactInput contacts[1];
  const bool by_force = stimulus.indenter.control == Indenter::Control::kForce;
  for (nanoseconds time{0}; time < end; time += tick) {
    const double now_s = units::s_from(time + tick);
    const double level = level_at(stimulus, now_s);
    contacts[0] = {.depth_mm = by_force ? 0.0 : level,
                   .force_mN = by_force ? level : 0.0,
                   .x_mm = kCentreX_mm + (stimulus.offset_across ? 0.0 : stimulus.offset_mm),
                   .y_mm = kCentreY_mm + (stimulus.offset_across ? stimulus.offset_mm : 0.0)};
    if (stimulus.trace && stimulus.trace->positioned()) {
      const PressTrace::Level at = stimulus.trace->at(now_s);
      contacts[0].x_mm += at.x_mm - stimulus.afferent_x_mm;
      contacts[0].y_mm += at.y_mm - stimulus.afferent_y_mm;
    }
    after_tick(model_.step(contacts, time));
  }
}

std::vector<std::vector<double>> Trials::run(const Stimulus& stimulus) {
  std::vector<std::vector<double>> times(model_.neurons());
  press(stimulus, [&](std::span<const SpikeEvent> spikes) {
    for (const SpikeEvent& spike : spikes) {
      times[spike.neuron - 1].push_back(units::s_from(spike.time));
    }
  });
  return times;
}

std::vector<double> Trials::energies_kPa(const Stimulus& stimulus) {
  std::vector<double> energies;
  press(stimulus, [&](std::span<const SpikeEvent> /*spikes*/) {
    energies.push_back(model_.patches().front().drive().output().front());
  });
  return energies;
}

Answer answer_of(const Stimulus& stimulus, const std::vector<std::vector<double>>& trials) {
  const auto mean_and_sd = [&](double begin) {
    double sum = 0.0;
    double sum2 = 0.0;
    for (const auto& times : trials) {
      const auto count = static_cast<double>(count_in(times, begin, begin + stimulus.count_s));
      sum += count;
      sum2 += count * count;
    }
    const auto n = static_cast<double>(trials.size());
    const double mean = sum / n;
    return std::pair{mean, std::sqrt(std::max(0.0, sum2 / n - mean * mean))};
  };
  if (!stimulus.decline_over_s) {
    const auto [mean, sd] = mean_and_sd(stimulus.settle_s);
    return {.value = mean / stimulus.count_s, .count_sd = sd};
  }
  const double first = mean_and_sd(stimulus.ramp_s + stimulus.decline_from_s).first;
  const double last =
      mean_and_sd(stimulus.ramp_s + *stimulus.decline_over_s - stimulus.count_s).first;
  return {.value = first > 0.0 ? 1.0 - last / first : 0.0, .count_sd = 0.0};
}

}  // namespace merkel
