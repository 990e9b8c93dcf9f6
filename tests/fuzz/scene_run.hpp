#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/scene/tactile_model.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {

/// Runs a parsed scene for some ticks under a press that comes and goes. A scene may be refused.
/// \param most_steps  neuron steps after which to stop early; 0: no limit
/// \return the error of the run, or an empty string
inline std::string fault_of_run(const Scene& scene, int ticks, double most_steps = 0.0) {
  auto model = TactileModel::create(scene.model);
  if (!model) {
    const bool explained = !model.error().key.empty() && !model.error().reason.empty();
    return explained ? "" : "refused without a reason";
  }
  const auto tick = scene.model.tick;
  const double steps_a_tick =
      static_cast<double>(tick / scene.model.step) * static_cast<double>(model->neurons());
  std::vector<ContactInput> inputs(model->indenters());
  std::chrono::nanoseconds time{0};
  for (int k = 0; k < ticks; ++k, time += tick) {
    if (most_steps > 0.0 && (k + 1) * steps_a_tick > most_steps) break;
    const bool touching = k % 10 < 7;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      inputs[i] = {.depth_mm = touching ? 1.5 : 0.0,
                   .force_mN = touching ? 300.0 : 0.0,
                   .x_mm = scene.probes[i].input.x_mm,
                   .y_mm = scene.probes[i].input.y_mm};
    }
    std::chrono::nanoseconds last = time;
    for (const SpikeEvent& spike : model->step(inputs, time)) {
      if (spike.time < last || spike.time > time + tick) return "a spike out of order";
      if (spike.neuron == 0) return "a spike of no neuron";
      last = spike.time;
    }
  }
  return model->spikes_refused() == 0 ? "" : "more spikes in a tick than there is room for";
}

/// The same for a scene's text, which may also be refused.
inline std::string fault_of_run(const std::string& text, int ticks, double most_steps = 0.0) {
  const auto scene = parse_scene(text, "s.toml");
  if (!scene) return scene.error().sentence.empty() ? "refused without a sentence" : "";
  return fault_of_run(*scene, ticks, most_steps);
}

/// All numeric keys of a scene file, as "table.key", for all kinds of neurons.
inline std::vector<std::string> number_keys() {
  std::vector<std::string> names;
  for (const char* const preset : {"paper", "goodwin"}) {
    Scene scene = *preset_scene(preset);
    for (const SceneSection& section : sections_of(scene)) {
      for (const BoundField& key : section.keys) {
        const bool number = std::holds_alternative<double*>(key.value) ||
                            std::holds_alternative<int*>(key.value) ||
                            std::holds_alternative<std::int64_t*>(key.value) ||
                            std::holds_alternative<std::chrono::nanoseconds*>(key.value);
        // Neither noise, which needs a seed, nor the host's load is varied.
        if (!number || key.field->key == "threads" || key.field->key == "noise") continue;
        if (std::find(names.begin(), names.end(), key.name()) == names.end()) {
          names.push_back(key.name());
        }
      }
    }
  }
  return names;
}

/// Unusual values.
inline constexpr const char* kUnusualValues[] = {
    "0",    "1",    "5",   "50",    "100",  "200",  "-1",  "-40",  "-77", "1e3",
    "1e-3", "1e-9", "1e9", "1e308", "-1e9", "0.49", "inf", "-inf", "nan", "1e-308"};

}  // namespace merkel
