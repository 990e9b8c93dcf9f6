#include "tools/scene/scene_keys.hpp"

#include "core/scene/model_fields.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

constexpr Field kSpikeTime[] = {
    {"spike_time_us", "µs", positive(1e6),
     "largest rms error of spike times in a rehearsal (1 s, with a network 4 s): the plan then sets "
     "method, precision and step",
     at<&Scene::spike_time_us>, "method, precision and step_us of [neuron] apply"}};

/// A patch of the scene, by name.
Choice patch_choice(std::size_t& patch) {
  return {&patch,
          [](const void* at) -> std::optional<std::size_t> {
            return *static_cast<const std::size_t*>(at);
          },
          [](void* at, std::size_t index) { *static_cast<std::size_t*>(at) = index; }};
}

/// A device or a group of the scene, by name; may be none.
Choice named_choice(std::optional<std::size_t>& device) {
  return {
      &device,
      [](const void* at) -> std::optional<std::size_t> {
        return *static_cast<const std::optional<std::size_t>*>(at);
      },
      [](void* at, std::size_t index) { *static_cast<std::optional<std::size_t>*>(at) = index; }};
}

constexpr Field kPatch[] = {{"patch", "", any_value(),
                             "name of the [[receptors]] on which the probe presses",
                             [](void* indenter) -> FieldPointer {
                               return patch_choice(static_cast<Indenter*>(indenter)->patch);
                             },
                             "the first"}};
constexpr Field kDevice[] = {
    {"device", "", any_value(), "name of the [[device]] that feeds the probe",
     [](void* probe) -> FieldPointer {
       return named_choice(static_cast<Scene::ProbeSettings*>(probe)->device);
     },
     "uri"}};
constexpr Field kElectrodePlace[] = {
    {"patch", "", any_value(), "name of the [[receptors]] that the field lies on",
     [](void* electrode) -> FieldPointer {
       return patch_choice(static_cast<Electrode*>(electrode)->patch);
     },
     "the first"},
    {"group", "", any_value(),
     "name of the [[electrode_group]] that it belongs to, which sets its encoder and frequency",
     [](void* electrode) -> FieldPointer {
       return named_choice(static_cast<Electrode*>(electrode)->group);
     },
     "it acts alone"}};

}  // namespace

FieldTable Scene::OfDevice::fields() {
  using D = Scene::OfDevice;
  static constexpr Field kFields[] = {
      {"name", "", any_value(), "by which probes name it in their key device", at<&D::name>},
      {"uri", "", any_value(), "source of its readings, opened once (see merkel run --help)",
       at<&D::uri>}};
  return {"device", kFields};
}

FieldTable Scene::ProbeSettings::fields() {
  using P = Scene::ProbeSettings;
  static constexpr std::string_view kControls[] = {"depth", "force"};
  static constexpr std::string_view kZeros[] = {"track", "fixed", "start"};
  static constexpr std::string_view kDecimations[] = {"last", "mean"};
  static constexpr Field kFields[] = {
      {"uri", "", any_value(), "source of the samples (see merkel run --help)", at<&P::uri>,
       "that of its device"},
      {"force", kNameOrNumber, any_value(),
       "channel of the device that is the force: its name, with or without its unit (thumb_N), or "
       "its column, from 1",
       at<&P::force>, "the device's own force, if no channel is chosen"},
      {"depth", kNameOrNumber, any_value(), "channel that is the depth", at<&P::depth>,
       "the device's own depth, if no channel is chosen"},
      {"x", kNameOrNumber, any_value(), "channel that is the position along the patch", at<&P::x>,
       "x_mm, or the device's own, if no channel is chosen"},
      {"y", kNameOrNumber, any_value(), "channel that is the position across the patch", at<&P::y>,
       "y_mm, or the device's own, if no channel is chosen"},
      {"calibration", "", any_value(),
       "file with the zero and gain of its readings, made by merkel calibrate", at<&P::calibration>,
       "none"},
      {"taxel_channels", "", any_value(),
       "how the names of the channels of a tactile array begin (pad_)", at<&P::taxel_channels>,
       "all forces and pressures of the device with names of their own"},
      {"x_mm", "mm", from_to(-1e4, 1e4),
       "position of samples without one; of the middle of an array",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->input.x_mm; }},
      {"y_mm", "mm", from_to(-1e4, 1e4),
       "position of samples without one; of the middle of an array",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->input.y_mm; }},
      {"control", "", one_of(kControls), "the reading that drives the contact", at<&P::control>,
       "force if the probe measures it, else depth"},
      {"invert_force", "", any_value(), "true: the sensor reports compression as a negative force",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->input.contact.invert_force; }},
      {"contact_N", "N", not_negative(1e3),
       "a measured force from here on touches, until it falls below half of it; above the noise of the "
       "sensor, which merkel connect measures; 0: any positive force touches",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->input.contact.contact_N; }},
      {"contact_mm", "mm", not_negative(1e3),
       "the same for the depth of a probe that is driven by its depth",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->input.contact.contact_mm; }},
      {"zero", "", one_of(kZeros),
       "zero of the measured force: track follows the drift of the sensor and needs contact_N; fixed "
       "is that of its calibration; start is the mean of the first 0.5 s, in which nothing may touch",
       [](void* p) { return detail::pointer_to(static_cast<P*>(p)->input.contact.zero); },
       "track for a device with contact_N; for a recording, what it was recorded with"},
      {"zero_drift_mN_per_s", "mN/s", positive(1e3),
       "the largest drift of the sensor that zero = \"track\" follows; two to three times what "
       "merkel connect measures",
       [](void* p) -> FieldPointer {
         return &static_cast<P*>(p)->input.contact.zero_drift_mN_per_s;
       }},
      {"decimate", "", one_of(kDecimations),
       "the input of a tick in which several samples lie: the last of them, or their mean, which is a "
       "low-pass filter and half a tick older",
       [](void* p) -> FieldPointer {
         return detail::choice_of(static_cast<P*>(p)->input.decimate);
       }},
      {"max_force_N", "N", positive(1e6),
       "a larger measured force is refused: a device's reading is dropped and counted, a recording ends",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->limits.force_N; }},
      {"max_depth_mm", "mm", positive(1e6),
       "a larger measured depth is refused: a device's reading is dropped and counted, a recording ends",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->limits.depth_mm; }},
      {"delay_ms", "ms", not_negative(1e6),
       "jitter buffer: how far a live run lags behind the samples", at<&P::delay>,
       "measured: the smallest that holds at most held_share of the ticks"},
      {"held_share", "", from_to(0.0, 0.5),
       "share of the ticks that may hold the last sample because the next one is late",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->input.held_share; }},
      {"max_delay_ms", "ms", positive(1e6),
       "the measured delay never exceeds it; later samples are held and counted",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->input.max_delay; },
       "50 ms for a probe above 100 Hz, else three sample periods"}};
  return {"probe", kFields};
}

BoundFields loop_keys(Scene& scene) {
  BoundFields keys = tick_fields(scene.model);
  bind_fields(scene.loop, keys);
  bind_fields(scene.loop.realtime, keys);
  return keys;
}

BoundFields accuracy_keys(Scene& scene) {
  BoundFields keys;
  bind_fields({"accuracy", kSpikeTime}, &scene, keys);
  bind_fields(scene.model.accuracy, keys);
  return keys;
}

BoundFields probe_keys(Scene& scene, std::size_t probe) {
  BoundFields keys;
  bind_fields({"probe", kPatch}, &scene.model.indenters[probe], keys);
  for (const auto& patch : scene.model.patches) keys.back().words.push_back(patch.name);
  for (BoundField& key : tip_kind_field(scene.model.indenters[probe])) keys.push_back(key);
  for (BoundField& key : tip_fields(scene.model.indenters[probe])) keys.push_back(std::move(key));
  bind_fields({"probe", kDevice}, &scene.probes[probe], keys);
  for (const auto& device : scene.devices) keys.back().words.push_back(device.name);
  bind_fields(scene.probes[probe], keys);
  return keys;
}

BoundFields group_keys(Scene& scene, std::size_t group) {
  ElectrodeGroup& bound = scene.encoding.groups[group];
  BoundFields keys;
  bind_fields({"electrode_group", Electrode::source_fields().fields}, &bound.pattern, keys);
  bind_fields(bound, keys);
  return keys;
}

BoundFields electrode_keys(Scene& scene, std::size_t electrode) {
  Electrode& bound = scene.encoding.electrodes[electrode];
  BoundFields keys;
  bind_fields({"electrode", kElectrodePlace}, &bound, keys);
  for (const auto& patch : scene.model.patches) keys[0].words.push_back(patch.name);
  for (const auto& group : scene.encoding.groups) keys[1].words.push_back(group.pattern.name);
  BoundFields source;
  bind_fields(Electrode::source_fields(), &bound, source);
  if (bound.group) {
    const bool has_field = scene.encoding.groups[*bound.group].pattern.field_mm.empty();
    std::erase_if(source, [has_field](const BoundField& key) {
      const std::string_view name = key.field->key;
      return name != "name" && !(name == "field_mm" && has_field);
    });
  }
  keys.insert(keys.end(), source.begin(), source.end());
  bind_fields(bound, keys);
  return keys;
}

std::vector<SceneSection> sections_of(Scene& scene) {
  TactileModel::Parameters& model = scene.model;
  std::vector<SceneSection> sections;
  for (Scene::OfDevice& device : scene.devices) {
    sections.push_back(
        {"[[device]]", "a device whose channels feed several probes", bind_fields(device)});
  }
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    sections.push_back({"[[probe]]", "a probe and its tip", probe_keys(scene, i)});
  }
  sections.push_back({"[skin]", "material and shape of the skin", bind_fields(model.skin)});
  for (SkinLayer& layer : model.skin.layers.all()) {
    sections.push_back({"[[skin.layer]]",
                        "an elastic layer, from the surface inwards; replaces the moduli and "
                        "thickness_mm of [skin]",
                        bind_fields(layer)});
  }
  for (auto& patch : model.patches) {
    sections.push_back({"[[receptors]]", "a patch of skin", receptor_fields(patch)});
  }
  sections.push_back({"[transduction]", "energy density to current, for hodgkin_huxley neurons",
                      bind_fields(model.transduction)});
  sections.push_back({"[afferent]", "energy density to drive, for all other neurons",
                      bind_fields(model.adaptation)});
  BoundFields neuron = neuron_kind_fields(model);
  for (BoundField& key : neuron_fields(model)) neuron.push_back(std::move(key));
  sections.push_back({"[neuron]", "", std::move(neuron)});
  sections.push_back(
      {"[network]", "coupling of hodgkin_huxley neurons", bind_fields(model.network)});
  sections.push_back({"[loop]", "ticks and the thread that computes them", loop_keys(scene)});
  sections.push_back({"[accuracy]", "what may be skipped", accuracy_keys(scene)});
  for (std::size_t i = 0; i < scene.encoding.groups.size(); ++i) {
    sections.push_back({"[[electrode_group]]",
                        "electrodes with one field, one drive and staggered pulses",
                        group_keys(scene, i)});
  }
  for (std::size_t i = 0; i < scene.encoding.electrodes.size(); ++i) {
    sections.push_back({"[[electrode]]",
                        "an electrode, the area of skin that it represents, and its encoder",
                        electrode_keys(scene, i)});
  }
  if (!scene.encoding.electrodes.empty()) {
    sections.push_back({"[stimulation]", "limits that no stimulation command exceeds",
                        bind_fields(scene.encoding.stimulation)});
  }
  if (!scene.encoding.stimulator.name.empty()) {
    sections.push_back({"[stimulator]",
                        "what the stimulator can do: commands are rounded down to it",
                        bind_fields(scene.encoding.stimulator)});
  }
  return sections;
}

}  // namespace merkel
