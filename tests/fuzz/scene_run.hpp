#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/scene/tactile_model.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// Runs a parsed scene for some ticks under a press that comes and goes. A scene may be refused.
/// \param most_steps  neuron steps after which to stop early; 0: no limit
/// \return what is wrong with the run, or nothing
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

/// The same for a scene's text, which may be refused too.
inline std::string fault_of_run(const std::string& text, int ticks, double most_steps = 0.0) {
  const auto scene = parse_scene(text, "s.toml");
  if (!scene) return scene.error().sentence.empty() ? "refused without a sentence" : "";
  return fault_of_run(*scene, ticks, most_steps);
}

struct SceneKey {
  const char* table;
  const char* name;
};

inline constexpr SceneKey kSceneKeys[] = {
    {"skin", "epidermis_kPa"},
    {"skin", "dermis_kPa"},
    {"skin", "poisson_ratio"},
    {"skin", "radius_mm"},
    {"skin", "receptor_depth_mm"},
    {"skin", "thickness_mm"},
    {"receptors", "count"},
    {"receptors", "density_per_mm2"},
    {"receptors", "density_max_per_mm2"},
    {"receptors", "density_min_per_mm2"},
    {"receptors", "length_mm"},
    {"receptors", "width_mm"},
    {"receptors", "columns"},
    {"receptors", "rows"},
    {"receptors", "field_receptors"},
    {"receptors", "field_radius_mm"},
    {"transduction", "alpha_uA_per_cm2"},
    {"transduction", "lambda_kPa"},
    {"transduction", "gamma_per_kPa"},
    {"transduction", "threshold_um"},
    {"afferent", "gain_Hz_per_kPa"},
    {"afferent", "fast_weight"},
    {"afferent", "slow_weight"},
    {"afferent", "fast_ms"},
    {"afferent", "slow_ms"},
    {"afferent", "gain_spread"},
    {"neuron", "capacitance_uF_per_cm2"},
    {"neuron", "g_Na"},
    {"neuron", "g_K"},
    {"neuron", "g_L"},
    {"neuron", "g_CaL"},
    {"neuron", "g_A"},
    {"neuron", "E_Na"},
    {"neuron", "E_K"},
    {"neuron", "E_Ca"},
    {"neuron", "E_A"},
    {"neuron", "E_L"},
    {"neuron", "V_rest"},
    {"neuron", "spike_threshold_mV"},
    {"neuron", "tau_ms"},
    {"neuron", "threshold"},
    {"neuron", "reset"},
    {"neuron", "floor"},
    {"neuron", "refractory_ms"},
    {"neuron", "compression_ms"},
    {"neuron", "step_us"},
    {"network", "gain"},
    {"network", "weight_min"},
    {"network", "weight_max"},
    {"accuracy", "cull_tolerance"},
    {"probe", "radius_mm"},
    {"probe", "x_mm"},
    {"loop", "tick_us"},
};

/// Values that few scenes have.
inline constexpr const char* kUnusualValues[] = {
    "0",    "1",    "5",   "50",    "100",  "200",  "-1",  "-40",  "-77", "1e3",
    "1e-3", "1e-9", "1e9", "1e308", "-1e9", "0.49", "inf", "-inf", "nan", "1e-308"};

}  // namespace merkel
