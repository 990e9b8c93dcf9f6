#include "tools/scene/scene_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/units.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/scene_table.hpp"

namespace merkel {
namespace {

using Findings = SceneTable::Findings;

using Words = std::vector<std::string>;

/// Reads one of several words, in the order of an enumeration's values.
template <class Enum>
void read_word(SceneTable& table, std::string_view key, const Words& words, Enum& value) {
  auto index = static_cast<std::size_t>(value);
  table.word(key, words, index);
  value = static_cast<Enum>(index);
}

/// Reads a time in a unit of `unit_ns` nanoseconds; whole nanoseconds, so that steps divide ticks
/// exactly.
void read_time(SceneTable& table, std::string_view key, double unit_ns,
               std::chrono::nanoseconds& value) {
  double amount = static_cast<double>(value.count()) / unit_ns;
  table.number(key, amount);
  const double ns = amount * unit_ns;
  // Out of range becomes 0, which every check refuses where the time must be positive.
  value = std::chrono::nanoseconds{ns >= 0.0 && ns < 9e18 ? std::llround(ns) : std::int64_t{0}};
}

void read_skin(SceneTable table, SkinParameters& skin) {
  table.number("epidermis_kPa", skin.epidermis_kPa)
      .number("dermis_kPa", skin.dermis_kPa)
      .number("poisson_ratio", skin.poisson_ratio)
      .number("radius_mm", skin.radius_mm)
      .number("receptor_depth_mm", skin.receptor_depth_mm)
      .number("thickness_mm", skin.thickness_mm);
  if (table.has("apex_mm")) {
    std::vector<double> apex;
    table.numbers("apex_mm", apex);
    if (apex.size() != 2) table.refuse("apex_mm", "must be two numbers: [x, y]");
    if (apex.size() == 2) skin.apex = {.x_mm = apex[0], .y_mm = apex[1]};
  }
  table.known("apex_mm");
  read_word(table, "contact_law", {"hertz", "sneddon"}, skin.contact_law);
  read_word(table, "layer_law", {"dimitriadis", "exact"}, skin.layer_law);
  read_word(table, "energy_density", {"distortional", "full"}, skin.energy_density);
  table.finish();
}

/// Pairs of coordinates, [[x, y], …].
void read_centres(SceneTable& table, PatchParameters& parameters) {
  std::vector<std::array<double, 2>> pairs;
  table.pairs("centres_mm", pairs);
  for (const auto& [x, y] : pairs) parameters.centres.push_back({.x_mm = x, .y_mm = y});
  if (!pairs.empty() && parameters.layout == ReceptorLayout::kSubregions) {
    table.refuse("centres_mm",
                 "is only of afferents with receptive fields: set layout = \"fields\"");
  }
}

void read_receptors(SceneTable table, PatchParameters& parameters) {
  ReceptorParameters& receptors = parameters.receptors;
  Patch& patch = parameters.patch;
  read_word(table, "placement", {"random", "lattice"}, receptors.placement);
  read_word(table, "layout", {"subregions", "fields"}, parameters.layout);
  read_centres(table, parameters);
  table.text("name", parameters.name)
      .seed("seed", receptors.seed)
      .whole("count", receptors.count)
      .whole("field_receptors", parameters.field.receptors)
      .number("field_radius_mm", parameters.field.radius_mm)
      .number("density_per_mm2", receptors.density_per_mm2)
      .number("density_max_per_mm2", receptors.density_max_per_mm2)
      .number("density_min_per_mm2", receptors.density_min_per_mm2)
      .number("length_mm", patch.length_mm)
      .number("width_mm", patch.width_mm)
      .whole("columns", patch.columns)
      .whole("rows", patch.rows)
      .finish();
}

void read_transduction(SceneTable table, SigmoidTransduction& transduction) {
  table.number("alpha_uA_per_cm2", transduction.alpha_uA_per_cm2)
      .number("lambda_kPa", transduction.lambda_kPa)
      .number("gamma_per_kPa", transduction.gamma_per_kPa)
      .number("threshold_um", transduction.threshold_um)
      .finish();
}

void read_afferent(SceneTable table, AdaptationParameters& afferent) {
  table.number("gain_Hz_per_kPa", afferent.gain_Hz_per_kPa)
      .number("fast_weight", afferent.fast_weight)
      .number("slow_weight", afferent.slow_weight)
      .number("fast_ms", afferent.fast_ms)
      .number("slow_ms", afferent.slow_ms)
      .number("gain_spread", afferent.gain_spread)
      .seed("seed", afferent.seed)
      .finish();
}

/// Noise that a scene asks for must be one that can be had again.
void read_noise(SceneTable& table, NeuronNoise& noise) {
  const bool seeded = table.has("seed");
  table.number("noise", noise.sigma).seed("seed", noise.seed);
  if (table.has("noise") && noise.sigma != 0.0 && !seeded) {
    table.refuse(
        "noise",
        "needs a seed, so that a run can be repeated: add seed = 1 beside it, or any other "
        "whole number");
  }
}

const Words kNeuronKinds = {"hodgkin_huxley", "integrate_and_fire", "connor_stevens"};

void read_neuron(SceneTable table, TactileModel::Parameters& model) {
  NeuronKind kind = model.kind();
  read_word(table, "kind", kNeuronKinds, kind);
  if (kind != model.kind()) {
    model.afferent = default_afferent(kind);
    model.step = usual_step(kind);
  }
  if (auto* const integrate = std::get_if<IntegrateAndFireAfferent>(&model.afferent)) {
    IntegrateAndFire& neuron = integrate->neuron;
    read_time(table, "step_us", 1e3, model.step);
    read_noise(table, neuron.noise);
    table.number("tau_ms", neuron.tau_ms)
        .number("threshold", neuron.threshold)
        .number("reset", neuron.reset)
        .number("floor", neuron.floor)
        .number("refractory_ms", neuron.refractory_ms)
        .finish();
    return;
  }
  if (auto* const connor = std::get_if<ConnorStevensAfferent>(&model.afferent)) {
    ConnorStevens& neuron = connor->neuron;
    read_time(table, "step_us", 1e3, model.step);
    read_noise(table, neuron.noise);
    table.number("compression_ms", connor->compression_ms)
        .number("capacitance_uF_per_cm2", neuron.capacitance_uF_per_cm2)
        .number("g_Na", neuron.g_Na)
        .number("g_K", neuron.g_K)
        .number("g_A", neuron.g_A)
        .number("g_L", neuron.g_L)
        .number("E_Na", neuron.E_Na)
        .number("E_K", neuron.E_K)
        .number("E_A", neuron.E_A)
        .number("E_L", neuron.E_L)
        .number("spike_threshold_mV", neuron.spike_threshold_mV)
        .finish();
    return;
  }
  auto& afferent = std::get<HodgkinHuxleyAfferent>(model.afferent);
  HodgkinHuxley& neuron = afferent.neuron;
  read_word(table, "method", integration_method_names(), afferent.method);
  read_word(table, "precision", precision_names(), afferent.precision);
  read_time(table, "step_us", 1e3, model.step);
  table.number("capacitance_uF_per_cm2", neuron.capacitance_uF_per_cm2)
      .number("g_Na", neuron.g_Na)
      .number("g_K", neuron.g_K)
      .number("g_L", neuron.g_L)
      .number("g_CaL", neuron.g_CaL)
      .number("E_Na", neuron.E_Na)
      .number("E_K", neuron.E_K)
      .number("E_Ca", neuron.E_Ca)
      .number("V_rest", neuron.V_rest)
      .number("spike_threshold_mV", neuron.spike_threshold_mV)
      .finish();
}

void read_network(SceneTable table, NetworkParameters& network) {
  table.number("gain", network.gain)
      .number("weight_min", network.weight_min)
      .number("weight_max", network.weight_max)
      .seed("seed", network.seed)
      .finish();
}

void read_accuracy(SceneTable table, AccuracyParameters& accuracy,
                   std::optional<double>& spike_time_us) {
  if (table.has("spike_time_us")) {
    double budget = 0.0;
    table.number("spike_time_us", budget);
    spike_time_us = budget;
  }
  table.number("cull_tolerance", accuracy.cull_tolerance)
      .truth("freeze_resting", accuracy.freeze_resting)
      .known("spike_time_us")
      .finish();
}

/// The patch that a probe presses on, by the name of its [[receptors]].
void read_patch_of_probe(SceneTable& table, const std::vector<PatchParameters>& patches,
                         std::size_t& patch) {
  std::vector<std::string> names;
  for (const auto& each : patches) names.push_back(each.name);
  table.word("patch", names, patch);
}

void read_probe(SceneTable& table, Scene::OfProbe& probe, Indenter& indenter) {
  read_word(table, "tip", {"sphere", "bars", "pin"}, indenter.tip);
  table.text("uri", probe.uri)
      .number("radius_mm", indenter.radius_mm)
      .number("diameter_mm", indenter.pin.diameter_mm)
      .numbers("bar_widths_mm", indenter.bars.widths_mm)
      .numbers("bar_gaps_mm", indenter.bars.gaps_mm)
      .number("bar_length_mm", indenter.bars.length_mm)
      .number("x_mm", probe.input.x_mm)
      .number("y_mm", probe.input.y_mm);
  if (table.has("control")) {
    Indenter::Control control{};
    read_word(table, "control", {"depth", "force"}, control);
    probe.control = control;
  }
  if (table.has("delay_ms")) {
    std::chrono::nanoseconds delay{0};
    read_time(table, "delay_ms", 1e6, delay);
    probe.delay = delay;
  }
  table.known("control").known("delay_ms").finish();
}

/// Calls `read` for the table `key`, or for each of several.
template <class Read>
void for_each_table(SceneTable& root, std::string_view key, Findings& findings, Read read) {
  const toml::node* const node = root.find(key);
  if (node == nullptr) return;
  if (const toml::table* const one = node->as_table()) {
    read(*one);
  } else if (const toml::array* const several = node->as_array();
             several != nullptr && several->is_array_of_tables()) {
    for (const toml::node& each : *several) read(*each.as_table());
  } else {
    findings.fail(node->source(), std::string(key) + " must be a table: write [" +
                                      std::string(key) + "], or [[" + std::string(key) +
                                      "]] for each of several");
  }
}

/// Drops the probes of a preset that press on patches which the scene does not have.
void drop_stray_probes(Scene& scene) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    if (scene.model.indenters[i].patch >= scene.model.patches.size()) continue;
    scene.probes[kept] = scene.probes[i];
    scene.model.indenters[kept] = scene.model.indenters[i];
    ++kept;
  }
  scene.probes.resize(kept);
  scene.model.indenters.resize(kept);
}

Scene scene_of(const toml::table& root, Findings& findings) {
  SceneTable top(root, "", findings);
  std::size_t preset = 0;
  std::string name = root["preset"].value_or(std::string());
  if (present_name(name) == name) {
    top.word("preset", preset_names(), preset);
    name = preset_names()[preset];
  }
  top.known("preset");
  Scene scene = *preset_scene(name);
  const auto one = [&](std::string_view key, auto read) {
    const toml::node* const node = top.find(key);
    if (node == nullptr) return;
    if (const toml::table* const table = node->as_table()) {
      read(SceneTable(*table, std::string(key), findings));
    } else {
      findings.fail(node->source(),
                    std::string(key) + " must be a table: write [" + std::string(key) + "]");
    }
  };
  one("skin", [&](SceneTable table) { read_skin(std::move(table), scene.model.skin); });
  std::vector<PatchParameters> patches;
  for_each_table(top, "receptors", findings, [&](const toml::table& table) {
    PatchParameters patch = scene.model.patches.front();
    // Patches that say nothing of it are drawn each in its own way.
    patch.receptors.seed += patches.size();
    read_receptors(SceneTable(table, "receptors", findings), patch);
    patches.push_back(std::move(patch));
  });
  if (!patches.empty()) {
    scene.model.patches = std::move(patches);
    drop_stray_probes(scene);
  }
  one("accuracy", [&](SceneTable table) {
    read_accuracy(std::move(table), scene.model.accuracy, scene.spike_time_us);
  });
  one("transduction",
      [&](SceneTable table) { read_transduction(std::move(table), scene.model.transduction); });
  one("afferent",
      [&](SceneTable table) { read_afferent(std::move(table), scene.model.adaptation); });
  one("neuron", [&](SceneTable table) { read_neuron(std::move(table), scene.model); });
  one("network", [&](SceneTable table) { read_network(std::move(table), scene.model.network); });

  // The default network is one of the default neurons.
  if (scene.model.energy_driven() && top.find("network") == nullptr) scene.model.network.gain = 0.0;

  std::chrono::nanoseconds stale_after = ProbeInput::Parameters{}.stale_after;
  one("loop", [&](SceneTable table) {
    read_time(table, "tick_us", 1e3, scene.model.tick);
    read_time(table, "stale_after_ms", 1e6, stale_after);
    if (table.has("max_catch_up_ticks")) {
      std::int64_t ticks = 0;
      table.whole("max_catch_up_ticks", ticks);
      scene.max_catch_up_ticks = ticks;
    }
    read_loop_settings(table, scene.loop);
    table.known("max_catch_up_ticks").finish();
  });

  std::vector<Scene::OfProbe> probes;
  std::vector<Indenter> indenters;
  const auto centre_of = [&](std::size_t patch) {
    const Patch& skin = scene.model.patches[patch].patch;
    return ProbeInput::Parameters{
        .stale_after = stale_after, .x_mm = 0.5 * skin.length_mm, .y_mm = 0.5 * skin.width_mm};
  };
  for_each_table(top, "probe", findings, [&](const toml::table& table) {
    Scene::OfProbe probe = scene.probes.front();
    Indenter indenter = scene.model.indenters.front();
    SceneTable keys(table, "probe", findings);
    read_patch_of_probe(keys, scene.model.patches, indenter.patch);
    probe.input = centre_of(indenter.patch);
    read_probe(keys, probe, indenter);
    probes.push_back(std::move(probe));
    indenters.push_back(indenter);
  });
  if (!probes.empty()) {
    scene.probes = std::move(probes);
    scene.model.indenters = std::move(indenters);
  } else {
    for (std::size_t i = 0; i < scene.probes.size(); ++i) {
      scene.probes[i].input = centre_of(scene.model.indenters[i].patch);
    }
  }
  for_each_table(top, "sink", findings, [&](const toml::table& table) {
    std::string uri;
    SceneTable(table, "sink", findings).text("uri", uri).finish();
    if (uri.empty()) findings.fail(table.source(), "sink.uri is missing: name where spikes go");
    scene.sinks.push_back(std::move(uri));
  });
  top.finish();
  return scene;
}

/// Whether some probes are to press by depth and others by force, as far as the scene says.
bool mixes_control(const Scene& scene) {
  const auto wants = [&](Indenter::Control control) {
    return std::any_of(scene.probes.begin(), scene.probes.end(),
                       [control](const auto& probe) { return probe.control == control; });
  };
  return wants(Indenter::Control::kDepth) && wants(Indenter::Control::kForce);
}

}  // namespace

void Scene::set_probes(const std::vector<std::string>& uris) {
  probes.resize(uris.size(), probes.back());
  model.indenters.resize(uris.size(), model.indenters.back());
  for (std::size_t i = 0; i < uris.size(); ++i) probes[i].uri = uris[i];
}

void Scene::set_seed(std::uint64_t seed) {
  model.network.seed = seed;
  model.adaptation.seed = seed;
  if (NeuronNoise* const noise = model.noise()) noise->seed = seed;
  for (auto& patch : model.patches) patch.receptors.seed = seed++;
}

std::string Scene::sentence(const ParameterError& error) const {
  const auto line = line_of.find(error.key);
  const std::string where =
      file.empty() ? "" : file + (line == line_of.end() ? "" : ":" + std::to_string(line->second));
  return where + (where.empty() ? "" : ": ") + error.key + " " + error.reason;
}

Expected<Scene, SetupError> parse_scene(const std::string& text, const std::string& name) {
  const auto root = parse_toml(text);
  if (!root) {
    return bad_input(name + ":" + std::to_string(root.error().line) +
                     ": this is not TOML: " + root.error().reason);
  }
  Findings findings{.file = name, .error = {}, .line_of = {}};
  Scene scene = scene_of(*root, findings);
  if (!findings.error.empty()) return bad_input(findings.error);
  scene.file = name;
  scene.text = text;
  scene.line_of = std::move(findings.line_of);
  const auto checked =
      ParameterCheck()
          .positive("accuracy.spike_time_us", scene.spike_time_us.value_or(1.0))
          .whole_in_range("loop.max_catch_up_ticks", scene.max_catch_up_ticks.value_or(0), 0,
                          1'000'000)
          .also(scene.loop.check())
          .require(scene.probes.front().input.stale_after.count() > 0, "loop.stale_after_ms",
                   "must be a positive number of milliseconds")
          .require(!mixes_control(scene), "probe.control", kMixedControl)
          .result();
  if (!checked) return bad_input(scene.sentence(checked.error()));
  return scene;
}

Expected<Scene, SetupError> read_scene(const std::string& path) {
  const auto text = read_toml_text(path, "scene");
  if (!text) return Unexpected<SetupError>(text.error());
  return parse_scene(*text, path);
}

}  // namespace merkel
