#include "tools/scene/scene_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include "core/scene/model_fields.hpp"
#include "drivers/files/height_map_file.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/scene_stimulation.hpp"
#include "tools/scene/scene_table.hpp"

namespace merkel {
namespace {

using Findings = SceneTable::Findings;

void read_receptors(SceneTable table, PatchParameters& patch) {
  table.read(receptor_fields(patch));
  if (!patch.centres.empty() && patch.layout == ReceptorLayout::kSubregions) {
    table.refuse("centres_mm",
                 "applies only to afferents with receptive fields: set layout = \"fields\"");
  }
  table.finish();
}

void read_neuron(SceneTable table, const std::string& kind, TactileModel::Parameters& model) {
  if (kind == "connor_stevens") {
    table.refuse("kind", "connor_stevens no longer exists: use integrate_and_fire, as in goodwin");
    return;
  }
  table.read(neuron_kind_fields(model));
  const BoundFields keys = neuron_fields(model);
  table.read(keys);
  // Noise must be reproducible.
  const auto noise = std::find_if(keys.begin(), keys.end(),
                                  [](const BoundField& key) { return key.field->key == "noise"; });
  if (noise != keys.end() && table.has("noise") && !table.has("seed") &&
      *std::get<double*>(noise->value) != 0.0) {
    table.refuse("noise",
                 "needs a seed, so that a run can be repeated: add seed = 1, or any other whole "
                 "number, to the same table");
  }
  table.finish();
}

/// Drops the probes of a preset that press on patches which the scene does not have.
void drop_unused_probes(Scene& scene) {
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

/// A patch with the name of one of the preset's starts with the values of that one; others start
/// with those of the first, but are drawn differently.
void read_patches(SceneTable& root, Findings& findings, Scene& scene) {
  std::vector<PatchParameters> patches;
  const auto& of_preset = scene.model.patches;
  for_each_table(root, "receptors", findings, [&](const toml::table& table) {
    const auto name = table["name"].value_or(std::string());
    const auto same = std::find_if(of_preset.begin(), of_preset.end(), [&](const auto& each) {
      return !name.empty() && each.name == name;
    });
    PatchParameters patch = same != of_preset.end() ? *same : of_preset.front();
    if (same == of_preset.end()) patch.receptors.seed += patches.size();
    read_receptors(SceneTable(table, "receptors", findings), patch);
    patches.push_back(std::move(patch));
  });
  if (patches.empty()) return;
  scene.model.patches = std::move(patches);
  drop_unused_probes(scene);
}

void read_devices(SceneTable& root, Findings& findings, Scene& scene) {
  for_each_table(root, "device", findings, [&](const toml::table& table) {
    Scene::OfDevice device;
    SceneTable reader(table, "device", findings);
    reader.read(bind_fields(device)).finish();
    const auto same = [&](const Scene::OfDevice& other) { return other.name == device.name; };
    if (device.name.empty() || device.uri.empty()) {
      findings.fail(table.source(),
                    "a [[device]] has a name, for the probes that it feeds, and a uri: set both");
    } else if (std::any_of(scene.devices.begin(), scene.devices.end(), same)) {
      reader.refuse("name", "is that of another device: give each its own");
    } else if (device.uri.starts_with("fused:") || split_fragment(device.uri).second) {
      reader.refuse("uri",
                    "must be that of one device without #: choose its channels by the keys force, "
                    "depth, x and y of [[probe]]");
    }
    scene.devices.push_back(std::move(device));
  });
}

/// Checks where a probe gets its samples.
void check_source(SceneTable& table, Scene::ProbeSettings& probe) {
  if (table.has("device")) {
    if (table.has("uri")) {
      table.refuse("uri", "is not needed, because the probe has a device: remove one of them");
    }
    probe.uri.clear();
    return;
  }
  const bool chosen = !(probe.force + probe.depth + probe.x + probe.y).empty();
  if (chosen && split_fragment(probe.uri).second) {
    table.refuse("uri",
                 "already names channels after #: remove them, or the keys force, depth, x "
                 "and y");
  }
}

/// The keys of other tips have no effect, but must have values that those tips could take.
void read_other_tips(SceneTable& reader, const Indenter& indenter) {
  for (std::size_t kind = 0; kind < kTipNames.size(); ++kind) {
    if (kind == indenter.tip.index()) continue;
    Indenter other = indenter;
    other.tip = default_tip(kind);
    reader.read(tip_fields(other));
  }
}

/// Probes without a position press at the centre of their patch.
void read_probes(SceneTable& root, Findings& findings, Scene& scene) {
  const auto to_centre = [&scene](std::size_t i) {
    const Patch& skin = scene.model.patches[scene.model.indenters[i].patch].patch;
    scene.probes[i].input = {.stale_after = scene.loop.stale_after,
                             .interpolate = scene.loop.interpolation == Interpolation::kLinear,
                             .x_mm = 0.5 * skin.length_mm,
                             .y_mm = 0.5 * skin.width_mm};
  };
  const Scene::ProbeSettings first_probe = scene.probes.front();
  const Indenter first_indenter = scene.model.indenters.front();
  std::size_t count = 0;
  for_each_table(root, "probe", findings, [&](const toml::table& table) {
    if (count == 0) {
      scene.probes.clear();
      scene.model.indenters.clear();
    }
    scene.probes.push_back(first_probe);
    scene.model.indenters.push_back(first_indenter);
    SceneTable reader(table, "probe", findings);
    const auto patch_and_tip = [&] {
      const BoundFields keys = probe_keys(scene, count);
      return BoundFields{keys.begin(), keys.begin() + 2};
    };
    reader.read(patch_and_tip());
    read_other_tips(reader, scene.model.indenters.back());
    const BoundFields keys = probe_keys(scene, count);
    if (reader.has("device") && scene.devices.empty()) {
      reader.refuse("device",
                    "names a device, but the scene has none: add [[device]] with a name and a uri");
    }
    to_centre(count);
    reader.read({keys.begin() + 2, keys.end()});
    check_source(reader, scene.probes.back());
    reader.finish();
    ++count;
  });
  if (count > 0) return;
  for (std::size_t i = 0; i < scene.probes.size(); ++i) to_centre(i);
}

void read_skin(SceneTable table, Findings& findings, SkinParameters& skin) {
  table.read(bind_fields(skin));
  if (table.has("radius_mm") && !table.has("radius_along_mm")) flatten_if_infinite(skin);
  table.refuse(
      "layer_law",
      "no longer exists: skin on bone is always solved, as with \"exact\"; remove the key");
  for_each_table(table, "layer", findings, [&](const toml::table& layer) {
    if (skin.layers.count == SkinLayers::kMax) {
      findings.fail(layer.source(), "skin.layer may have at most 10 layers");
      return;
    }
    SkinLayer& read = skin.layers.layer[skin.layers.count++];
    read = {};
    SceneTable(layer, "skin.layer", findings).read(bind_fields(read)).finish();
  });
  table.finish();
}

/// The heights of measured shapes: given, or of files whose names are relative to the folder of the
/// scene's file.
void read_shapes(const std::string& scene_file, const std::vector<std::string>& given,
                 Findings& findings, Scene& scene) {
  std::size_t shapes = 0;
  for (Indenter& indenter : scene.model.indenters) {
    auto* const shape = std::get_if<ShapeTip>(&indenter.tip);
    if (shape == nullptr || shape->file.empty()) continue;
    const std::size_t number = shapes++;
    const bool known = number < given.size() && !given[number].empty();
    if (!known) shape->file = beside_scene(scene_file, shape->file);
    auto map = known ? parse_csv_heights(given[number], shape->file, shape->pixel_mm)
                     : read_height_map(shape->file, shape->pixel_mm);
    if (map) {
      shape->map = std::make_shared<HeightMap>(std::move(*map));
    } else if (findings.error.empty()) {
      findings.error = findings.file + ": " + map.error().sentence;
    }
  }
}

Scene scene_of(const toml::table& root, Findings& findings) {
  SceneTable top(root, "", findings);
  std::size_t preset = 0;
  const std::string retired = retired_preset(root["preset"].value_or(std::string()));
  if (retired.empty()) {
    top.word("preset", preset_names(), preset);
  } else {
    top.refuse("preset", retired);
  }
  Scene scene = *preset_scene(preset_names()[preset]);
  const auto read = [&](std::string_view table, const BoundFields& keys) {
    with_table(top, table, findings, [&](SceneTable reader) { reader.read(keys).finish(); });
  };
  with_table(top, "skin", findings,
             [&](SceneTable table) { read_skin(std::move(table), findings, scene.model.skin); });
  read_patches(top, findings, scene);
  read("accuracy", accuracy_keys(scene));
  read("transduction", bind_fields(scene.model.transduction));
  read("afferent", bind_fields(scene.model.adaptation));
  with_table(top, "neuron", findings, [&](SceneTable table) {
    read_neuron(std::move(table), root["neuron"]["kind"].value_or(std::string()), scene.model);
  });
  read("network", bind_fields(scene.model.network));
  // The default coupling is for the default neurons.
  if (scene.model.energy_driven() && !top.has("network")) scene.model.network.gain = 0.0;
  read("loop", loop_keys(scene));
  read_devices(top, findings, scene);
  read_probes(top, findings, scene);
  read_stimulation(top, findings, scene);
  for_each_table(top, "sink", findings, [&](const toml::table& table) {
    std::string uri;
    SceneTable(table, "sink", findings).text("uri", uri).finish();
    if (uri.empty())
      findings.fail(table.source(), "sink.uri is missing: set the destination of the spikes");
    scene.sinks.push_back(std::move(uri));
  });
  top.finish();
  scene.place_arrays();
  return scene;
}

/// True if the scene sets some probes to depth control and others to force control.
bool mixes_control(const Scene& scene) {
  const auto wants = [&](Indenter::Control control) {
    return std::any_of(scene.probes.begin(), scene.probes.end(),
                       [control](const auto& probe) { return probe.control == control; });
  };
  return wants(Indenter::Control::kDepth) && wants(Indenter::Control::kForce);
}

/// Checks that go beyond those of TactileModel::create.
Expected<void, ParameterError> check(const Scene& scene) {
  ParameterCheck all;
  Scene copy = scene;
  all.fields(accuracy_keys(copy)).also(scene.loop.check());
  // The positions of probes follow from the patches.
  for (PatchParameters& patch : copy.model.patches) all.fields(receptor_fields(patch));
  for (const Scene::ProbeSettings& probe : scene.probes) all.fields(probe);
  all.also(scene.encoding.check());
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    const Indenter& tip = scene.model.indenters[i];
    if (const TaxelArray* const taxels = tip.taxels()) {
      taxels->check(scene.model.skin, all);
    }
    all.require(tip.taxels() == nullptr || !scene.probes[i].input.contact.invert_force,
                "probe.invert_force",
                "has no effect on a tactile array: let its device report compression as positive");
    const ContactDecision::Parameters& contact = scene.probes[i].input.contact;
    all.require(contact.zero != ContactDecision::Zero::kTrack || contact.contact_N > 0.0 ||
                    tip.taxels() != nullptr,
                "probe.zero",
                "= \"track\" needs contact_N, several times the noise of the sensor at rest, which "
                "merkel connect measures");
    const auto& delay = scene.probes[i].delay;
    const auto& ceiling = scene.probes[i].input.max_delay;
    all.require(!delay || !ceiling || *delay <= *ceiling, "probe.max_delay_ms",
                "is smaller than delay_ms, which is never changed: remove one of the two");
  }
  return all.require(!mixes_control(scene), "probe.control", kMixedControl).result();
}

/// What a user wrote to no effect. Sessions of earlier versions may hold it.
Expected<void, ParameterError> check_used(const Scene& scene) {
  ParameterCheck all;
  for (std::size_t i = 0; i < scene.devices.size(); ++i) {
    all.require(std::any_of(scene.probes.begin(), scene.probes.end(),
                            [i](const auto& probe) { return probe.device == i; }),
                "device.name",
                "\"" + scene.devices[i].name +
                    "\" feeds no probe: set the key device of a [[probe]] to it, or remove it");
  }
  for (const auto& [key, line] : scene.line_of) {
    all.require(!scene.encoding.electrodes.empty() || !key.starts_with("stimulat"), key,
                "has no effect, because the scene has no electrodes: add [[electrode]], or remove "
                "the table");
  }
  return all.result();
}
}  // namespace

Expected<DeviceUri, SetupError> Scene::source_of(std::size_t probe) const {
  const ProbeSettings& of = probes[probe];
  auto source = DeviceUri::parse(of.device ? devices[*of.device].uri : of.uri);
  if (!source) return source;
  source->calibrations = {of.calibration};
  ChannelSelection channels{.of = {of.depth, of.force, of.x, of.y}, .by_unit = {}};
  const Indenter& tip = model.indenters[probe];
  if (const TaxelArray* const taxels = tip.taxels(); taxels && source->parts.empty()) {
    channels.taxels = {.count = taxels->size(),
                       .area_mm2 = taxels->area_mm2(),
                       .prefix = of.taxel_channels,
                       .tracks = of.input.contact.zero.value_or(ContactDecision::Zero::kTrack) ==
                                 ContactDecision::Zero::kTrack};
  }
  if (of.device || !channels.empty()) source->parts = {std::move(channels)};
  return source;
}

std::string Scene::uri_of(std::size_t probe) const {
  const auto source = source_of(probe);
  if (!source) return probes[probe].uri;
  return source->uri + (source->parts.empty() ? "" : "#" + source->parts.front().text());
}

void Scene::place_arrays() {
  for (std::size_t i = 0; i < probes.size(); ++i) {
    auto* const taxels = std::get_if<TaxelArray>(&model.indenters[i].tip);
    if (taxels) taxels->place = {.x_mm = probes[i].input.x_mm, .y_mm = probes[i].input.y_mm};
  }
}

Expected<void, SetupError> Scene::set_probes(const std::vector<std::string>& uris) {
  if (uris.size() < probes.size()) {
    std::string list;
    for (std::size_t i = 0; i < probes.size(); ++i) {
      const std::string& patch = model.patches[model.indenters[i].patch].name;
      list += (i == 0 ? "" : ", ") + std::to_string(i + 1) + (patch.empty() ? "" : " on " + patch) +
              " (" + uri_of(i) + ")";
    }
    return bad_input("the scene has " + std::to_string(probes.size()) + " probes, but " +
                     std::to_string(uris.size()) + (uris.size() == 1 ? " URI was" : " URIs were") +
                     " given: give one for each, in this order: " + list +
                     "; for fewer, write a scene with only their [[probe]] tables");
  }
  probes.resize(uris.size(), probes.back());
  model.indenters.resize(uris.size(), model.indenters.back());
  for (std::size_t i = 0; i < uris.size(); ++i) {
    ProbeSettings& probe = probes[i];
    probe.uri = uris[i];
    probe.device.reset();
    for (std::string* const channel : {&probe.force, &probe.depth, &probe.x, &probe.y}) {
      channel->clear();
    }
  }
  return {};
}

void Scene::set_seed(std::uint64_t seed) {
  model.network.seed = seed;
  model.adaptation.seed = seed;
  if (NeuronNoise* const noise = model.noise()) noise->seed = seed;
  for (auto& patch : model.patches) {
    patch.receptors.seed = seed;
    seed = (seed + 1) & kMaxSeed;
  }
}

std::string Scene::sentence(const ParameterError& error) const {
  const auto line = line_of.find(error.key);
  const std::string where =
      file.empty() ? "" : file + (line == line_of.end() ? "" : ":" + std::to_string(line->second));
  return where + (where.empty() ? "" : ": ") + error.key + " " + error.reason;
}

void flatten_if_infinite(SkinParameters& skin) {
  if (std::isinf(skin.radius_mm)) skin.radius_along_mm = 0.0;
}

Expected<Scene, SetupError> parse_scene(const std::string& text, const std::string& name,
                                        const std::vector<std::string>& shapes) {
  const auto root = parse_toml(text);
  if (!root) {
    return bad_input(name + ":" + std::to_string(root.error().line) +
                     ": this is not valid TOML: " + root.error().reason);
  }
  Findings findings{.file = name};
  Scene scene = scene_of(*root, findings);
  read_shapes(name, shapes, findings, scene);
  for (Scene::ProbeSettings& probe : scene.probes) {
    if (!probe.calibration.empty()) probe.calibration = beside_scene(name, probe.calibration);
  }
  if (!findings.error.empty()) return bad_input(findings.error);
  scene.file = name;
  scene.text = text;
  scene.line_of = std::move(findings.line_of);
  const auto checked = check(scene);
  if (!checked) return bad_input(scene.sentence(checked.error()));
  return scene;
}

std::vector<std::string> heights_of(const Scene& scene) {
  std::vector<std::string> heights;
  for (const Indenter& indenter : scene.model.indenters) {
    const auto* const shape = std::get_if<ShapeTip>(&indenter.tip);
    if (shape == nullptr || shape->file.empty()) continue;
    heights.push_back(shape->map ? csv_heights(*shape->map) : std::string());
  }
  return heights;
}

Expected<Scene, SetupError> read_scene(const std::string& path) {
  const auto text = read_whole_file(path, "scene", kMaxTomlBytes);
  if (!text) return Unexpected<SetupError>(text.error());
  auto scene = parse_scene(*text, path);
  if (!scene) return scene;
  if (auto used = check_used(*scene); !used) return bad_input(scene->sentence(used.error()));
  return scene;
}

}  // namespace merkel
