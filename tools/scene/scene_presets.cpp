#include "tools/scene/scene_presets.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include "core/parameters/nearest_name.hpp"
#include "drivers/files/example_file.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

/// The fingertip of Yao & Wang 2019 under a sphere of 2 mm radius: all defaults.
Scene paper() {
  Scene scene;
  scene.probes.push_back({.uri = "sim:ramp"});
  return scene;
}

/// The same with the wide transduction and low threshold of the paper's Figs 6 and 7.
Scene paper_wide() {
  Scene scene = paper();
  scene.model.transduction.lambda_kPa = 2e-4;
  scene.model.transduction.gamma_per_kPa = 2.5e4;
  return scene;
}

/// The fingertip whose afferents match recordings: a curved finger, receptive fields, adaptation,
/// and noisy integrate-and-fire neurons. `merkel score` reports the match.
Scene goodwin() {
  Scene scene = paper();
  TactileModel::Parameters& model = scene.model;
  // The fingertips of the recorded monkeys are 10 to 12 mm wide; along, their radius is about twice
  // that across.
  model.skin.radius_mm = 5.0;
  model.skin.radius_along_mm = 10.0;
  model.patches.front().layout = ReceptorLayout::kFields;
  model.patches.front().field = {.radius_mm = 1.4, .concentration = 1.25};
  model.network.gain = 0.0;
  set_kind(model, NeuronKind::kIntegrateAndFire);
  // Fitted; standard errors 4, 8 and 6 % (`merkel fit goodwin`).
  model.adaptation.gain_Hz_per_kPa = 20.7;
  model.adaptation.fast_weight = 58.9;
  model.adaptation.slow_weight = 1.006;
  return scene;
}

/// The same on skin as soft as human fingerpads: the mean of four subjects, whose forces under a
/// plate differ by a factor of about 2. E*(d) = 24 kPa·e^(d/1.65 mm). For one finger: `merkel fit
/// skin`.
Scene finger() {
  Scene scene = goodwin();
  SkinParameters& skin = scene.model.skin;
  // The published modulus is that of a finger whose plate touches as on a sphere of 7 mm.
  skin.radius_mm = 7.0;
  skin.radius_along_mm = 0.0;
  scene.model.patches.front().field = {};
  constexpr double kReducedModulus_kPa = 24.0;
  skin.epidermis_kPa = skin.dermis_kPa =
      kReducedModulus_kPa * (1.0 - skin.poisson_ratio * skin.poisson_ratio);
  skin.stiffening_mm = 1.65;
  // Contacts on soft skin are wider: at the receptor depth of `goodwin`, curvature would change the
  // rates too much. Chosen among 0.65, 0.9, 0.95, 1, 1.05 mm by the cost of the fit.
  skin.receptor_depth_mm = 1.05;
  AdaptationParameters& adaptation = scene.model.adaptation;
  // Fitted on this skin; standard errors 5 and 7 % (`merkel fit finger`).
  adaptation.gain_Hz_per_kPa = 22.9;
  adaptation.fast_weight = 632.0;
  adaptation.slow_weight = 1.05;
  return scene;
}

/// A hand: five fingertips and a palm, 4250 afferents of 28 receptors each, a probe on every patch.
Scene hand() {
  Scene scene;
  TactileModel::Parameters& model = scene.model;
  model.network.gain = 0.0;
  model.patches.clear();
  model.indenters.clear();
  const auto add = [&](const char* name, const Patch& patch) {
    const auto seed = static_cast<std::uint64_t>(model.patches.size() + 1);
    model.patches.push_back({.name = name,
                             .patch = patch,
                             .receptors = {.seed = seed, .count = 28LL * patch.subregions()}});
    model.indenters.push_back({.patch = model.indenters.size()});
    scene.probes.push_back(
        {.uri = "sim:ramp",
         .input = {.x_mm = 0.5 * patch.length_mm, .y_mm = 0.5 * patch.width_mm}});
  };
  for (const char* const finger : {"thumb", "index", "middle", "ring", "little"}) {
    add(finger, {.length_mm = 30.0, .width_mm = 20.0, .columns = 25, .rows = 18});
  }
  add("palm", {.length_mm = 100.0, .width_mm = 80.0, .columns = 50, .rows = 40});
  return scene;
}

struct Preset {
  const char* name;
  Scene (*make)();
  const char* meaning;
  bool fitted = false;  ///< to spheres pressed with kFittedForces_N
};

/// The two forces of the recorded curvatures in `merkel score`.
constexpr std::array kFittedForces_N = {0.098, 0.196};

constexpr Preset kPresets[] = {
    {"paper", paper, "20 coupled afferents under a sphere: the fingertip of Yao & Wang 2019"},
    {"paper-wide", paper_wide, "the same with the wide transduction of the paper's Figs 6 and 7"},
    {"goodwin", goodwin, "450 afferents of a curved fingertip, fitted to recordings", true},
    {"finger", finger,
     "goodwin on skin as soft as the mean of four human fingerpads, with deeper receptors", true},
    {"hand", hand, "five fingertips and a palm: 4250 afferents, six probes"}};

/// Null if there is none.
const Preset* preset_named(std::string_view name) {
  const auto* const found = std::find_if(std::begin(kPresets), std::end(kPresets),
                                         [name](const Preset& p) { return name == p.name; });
  return found == std::end(kPresets) ? nullptr : found;
}

/// The scene of a session for another run: without the sinks of the recording, and with the method
/// that its plan chose.
Expected<Scene, SetupError> recorded_scene(const std::string& path) {
  const auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  auto scene = scene_of_session(*session);
  if (!scene) return scene;
  scene->sinks.clear();
  scene->spike_time_us.reset();
  return scene;
}

/// True for a name without a folder or extension, unless such a file exists.
bool is_mistyped_name(const std::string& name) {
  std::error_code ignored;
  return name.find_first_of("/.") == std::string::npos && !std::filesystem::exists(name, ignored);
}

}  // namespace

std::string retired_preset(std::string_view name) {
  if (name != "goodwin-cs" && name != "goodwin-hh") return "";
  return std::string(name) +
         " no longer exists: use goodwin, whose afferents are fitted to the same recordings "
         "(versions up to 0.1 run it)";
}

std::optional<Scene> preset_scene(std::string_view name) {
  const Preset* const found = preset_named(name);
  if (found == nullptr) return std::nullopt;
  Scene scene = found->make();
  scene.preset = name;
  scene.text = "preset = \"" + std::string(name) + "\"\n";
  return scene;
}

std::optional<std::array<double, 2>> fitted_forces_N(std::string_view preset) {
  const Preset* const found = preset_named(preset);
  if (found == nullptr || !found->fitted) return std::nullopt;
  return kFittedForces_N;
}

const std::vector<std::string>& preset_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Preset& preset : kPresets) all.emplace_back(preset.name);
    return all;
  }();
  return names;
}

std::string preset_list(std::string_view before, std::string_view between) {
  std::string text;
  for (const Preset& preset : kPresets) {
    text.append(before).append(preset.name).append(between).append(preset.meaning).append("\n");
  }
  return text;
}

std::string example_scene_list(std::string_view before, std::string_view between) {
  std::string text;
  for (const std::string& name : example_names(Example::kScene)) {
    std::ifstream file(path_or_example(Example::kScene, name));
    std::string meaning;
    std::getline(file, meaning);
    text.append(before).append(name).append(between);
    text.append(meaning.starts_with("# ") ? meaning.substr(2) : meaning).append("\n");
  }
  return text;
}

Expected<Scene, SetupError> scene_named(const std::string& name_or_file) {
  const auto preset = preset_scene(name_or_file.empty() ? "paper" : name_or_file);
  if (preset) return *preset;
  if (const auto retired = retired_preset(name_or_file); !retired.empty()) {
    return bad_input("the preset " + retired);
  }
  const std::string file = path_or_example(Example::kScene, name_or_file);
  if (SessionSamples::is_session(file)) return recorded_scene(file);
  if (!is_mistyped_name(file)) return read_scene(file);
  std::vector<std::string> names = preset_names();
  const std::vector<std::string> examples = example_names(Example::kScene);
  names.insert(names.end(), examples.begin(), examples.end());
  return bad_input(
      "there is no preset, example or scene file " + name_or_file +
      did_you_mean(name_or_file, names, ": merkel scene --list prints the presets and examples"));
}

}  // namespace merkel
