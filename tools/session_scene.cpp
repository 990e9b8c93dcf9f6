#include "tools/session_scene.hpp"

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/machine_facts.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMostProbes = 64;

std::optional<std::uint64_t> to_seed(std::string_view text) {
  std::uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return seed;
}

}  // namespace

RunDescription describe_run(const Scene& scene, const TactileModel& model) {
  RunDescription run;
  run.model = model.parameters();
  for (const TactilePatch& patch : model.patches()) {
    const auto receptors = patch.drive().receptors();
    run.receptors.emplace_back(receptors.begin(), receptors.end());
  }
  // The name of the file without its folders, or the preset.
  const std::string& file = scene.file;
  run.scene = file.empty() ? "paper" : file.substr(file.find_last_of('/') + 1);
  std::string controls;
  for (const Indenter& indenter : run.model.indenters) {
    controls += indenter.control == Indenter::Control::kDepth ? 'd' : 'f';
  }
  run.facts = {{"version", MERKEL_VERSION},
               {"git_hash", kGitHash},
               {"scene_text", scene.text},
               {"controls", controls},
               {"network_seed", std::to_string(run.model.network.seed)},
               {"method", std::string(name_of(run.model.method))},
               {"precision", std::string(name_of(run.model.precision))},
               {"tick_ns", std::to_string(run.model.tick.count())},
               {"step_ns", std::to_string(run.model.step.count())},
               {"neurons", std::to_string(model.neurons())}};
  for (const TactileModel::PatchParameters& patch : run.model.patches) {
    run.facts.emplace_back("receptor_seed", std::to_string(patch.receptors.seed));
  }
  for (const Scene::OfProbe& probe : scene.probes) run.facts.emplace_back("probe", probe.uri);
  for (auto& fact : machine_facts()) run.facts.push_back(std::move(fact));
  return run;
}

Expected<Scene, SetupError> scene_of_session(const SessionReader& session) {
  if (session.fact("scene_text").empty()) {
    return bad_input(
        "the session was recorded without a simulation: only those of merkel run know a scene");
  }
  const std::string name = session.fact("scene");
  auto scene = parse_scene(session.fact("scene_text"), name.empty() ? "the session's scene" : name);
  if (!scene) return scene;
  const std::string controls = session.fact("controls");
  if (controls.empty() || controls.size() > kMostProbes ||
      controls.find_first_not_of("df") != std::string::npos) {
    return bad_input("the session does not say what its probes measured: it is damaged");
  }
  auto& indenters = scene->model.indenters;
  indenters.resize(controls.size(), indenters.back());
  scene->probes.resize(controls.size(), scene->probes.back());
  for (std::size_t i = 0; i < controls.size(); ++i) {
    indenters[i].control =
        controls[i] == 'd' ? Indenter::Control::kDepth : Indenter::Control::kForce;
  }
  // The command line may have set other seeds than the scene.
  const auto network_seed = to_seed(session.fact("network_seed"));
  const std::vector<std::string> receptor_seeds = session.facts("receptor_seed");
  if (!network_seed || receptor_seeds.size() != scene->model.patches.size()) {
    return bad_input("the session does not say its seeds: it is damaged");
  }
  scene->model.network.seed = *network_seed;
  for (std::size_t i = 0; i < receptor_seeds.size(); ++i) {
    const auto seed = to_seed(receptor_seeds[i]);
    if (!seed) return bad_input("the session does not say its seeds: it is damaged");
    scene->model.patches[i].receptors.seed = *seed;
  }
  // A plan may have chosen another method than the scene's text says.
  if (const auto method = integration_method_named(session.fact("method"))) {
    scene->model.method = *method;
  }
  scene->model.precision = session.fact("precision") == name_of(Precision::kFloat)
                               ? Precision::kFloat
                               : Precision::kDouble;
  if (const auto step = to_seed(session.fact("step_ns")); step && *step > 0) {
    scene->model.step = std::chrono::nanoseconds{static_cast<std::int64_t>(*step)};
  }
  return scene;
}

}  // namespace merkel
