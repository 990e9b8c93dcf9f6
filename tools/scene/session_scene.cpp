#include "tools/scene/session_scene.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/parameters/range.hpp"
#include "core/scene/tactile_patch.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "drivers/uri.hpp"
#include "tools/scene/machine_facts.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxProbes = 64;
/// Present in sessions that number the neurons consecutively through all patches.
constexpr const char* kNumbering = "neuron_numbers";
constexpr const char* kThroughPatches = "through all patches";

/// Heights of a measured shape, so that a session needs no other file.
constexpr const char* kShapeFact = "shape_heights_mm";
constexpr std::size_t kMaxShapeBytes = std::size_t{8}
                                       << 20U;  ///< a chunk has at most twice as many

/// A seed of a scene that the command line may have set, except those of the patches.
struct NamedSeed {
  std::string name;
  std::uint64_t* value;  ///< null if the scene's neurons have no such noise
};

std::vector<NamedSeed> seeds_of(TactileModel::Parameters& model) {
  std::vector<NamedSeed> seeds{{"network_seed", &model.network.seed},
                               {"afferent_seed", &model.adaptation.seed}};
  TactileModel::Parameters other;
  for (std::size_t i = 0; i < kNeuronKinds.size(); ++i) {
    const auto kind = static_cast<NeuronKind>(i);
    set_kind(other, kind);
    if (other.noise() == nullptr) continue;
    seeds.push_back({std::string(kNeuronKinds[i]) + "_seed",
                     model.kind() == kind ? &model.noise()->seed : nullptr});
  }
  return seeds;
}

/// Method and precision of Hodgkin-Huxley neurons; other neurons have only one of each.
HodgkinHuxleyAfferent stepping_of(const TactileModel::Parameters& model) {
  const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&model.afferent);
  return paper != nullptr ? *paper : HodgkinHuxleyAfferent{};
}

}  // namespace

void add_probe_facts(const ProbeInfo& probe, RunDescription& run) {
  if (probe.taxels > 0) {
    run.facts.emplace_back(kTaxelFact,
                           std::to_string(run.probes.size()) + ":" + std::to_string(probe.taxels));
  }
  run.probes.push_back(probe);
  for (const auto& [name, value] :
       {std::pair("probe", &probe.uri), std::pair("probe_name", &probe.name),
        std::pair("probe_serial_number", &probe.serial_number),
        std::pair("probe_calibration_file", &probe.calibration_file),
        std::pair("probe_calibration", &probe.calibration)}) {
    run.facts.emplace_back(name, *value);
  }
}

RunDescription describe_run(const Scene& scene, const TactileModel& model) {
  RunDescription run;
  run.model = model.parameters();
  run.encoding = scene.encoding;
  // The file's name without its folders, or the preset.
  const std::string& file = scene.file;
  run.scene = file.empty() ? scene.preset : file.substr(file.find_last_of('/') + 1);
  std::string controls;
  for (const Indenter& indenter : run.model.indenters) {
    controls += indenter.control == Indenter::Control::kDepth ? 'd' : 'f';
  }
  run.facts = {{"version", MERKEL_VERSION},
               {"git_hash", kGitHash},
               {"scene_text", scene.text},
               {"controls", controls},
               {"method", std::string(name_of(stepping_of(run.model).method))},
               {"precision", std::string(name_of(stepping_of(run.model).precision))},
               {"tick_ns", std::to_string(run.model.tick.count())},
               {"step_ns", std::to_string(run.model.step.count())},
               {"neurons", std::to_string(model.neurons())},
               {kNumbering, kThroughPatches}};
  for (const NamedSeed& seed : seeds_of(run.model)) {
    const std::uint64_t value = seed.value != nullptr ? *seed.value : NeuronNoise{}.seed;
    run.facts.emplace_back(seed.name, std::to_string(value));
  }
  for (const PatchParameters& patch : run.model.patches) {
    run.facts.emplace_back("receptor_seed", std::to_string(patch.receptors.seed));
  }
  for (std::string& heights : heights_of(scene)) {
    // The replay of a larger one needs its file.
    if (heights.size() > kMaxShapeBytes) break;
    run.facts.emplace_back(kShapeFact, std::move(heights));
  }
  for (auto& fact : machine_facts()) run.facts.push_back(std::move(fact));
  return run;
}

Expected<std::vector<ProbeInfo>, SetupError> probes_of_session(const std::string& path) {
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  std::vector<ProbeInfo> probes;
  for (const std::string& uri : session->facts("probe")) {
    probes.push_back({.uri = uri, .name = {}, .serial_number = {}});
    probes.back().extra_columns = session->extra_columns();
  }
  const auto fill = [&](const char* fact, std::string ProbeInfo::*member) {
    const std::vector<std::string> values = session->facts(fact);
    for (std::size_t i = 0; i < std::min(values.size(), probes.size()); ++i) {
      probes[i].*member = values[i];
    }
  };
  fill("probe_name", &ProbeInfo::name);
  fill("probe_serial_number", &ProbeInfo::serial_number);
  fill("probe_calibration_file", &ProbeInfo::calibration_file);
  fill("probe_calibration", &ProbeInfo::calibration);
  const auto start = session_start(*session);
  if (!start) return Unexpected<SetupError>(start.error());
  std::size_t missing = probes.size();
  const auto read = session->for_each([&](const SessionChunk& chunk) {
    for (const DeliveredSample& each : chunk.samples) {
      if (each.probe >= probes.size() || probes[each.probe].channels != 0U) continue;
      probes[each.probe].channels = each.sample.channels;
      // Else a trace of these samples has the ticks of the run without being told.
      if (each.sample.time != *start) probes[each.probe].run = RecordedRun{.start = *start};
      --missing;
    }
    return missing > 0;
  });
  if (!read) return Unexpected<SetupError>(read.error());
  return probes;
}

Expected<void, SetupError> set_probes(Scene& scene, std::vector<std::string> uris) {
  const std::size_t wanted = scene.probes.size();
  const auto uri =
      uris.size() == 1 && wanted > 1 ? Uri::parse(uris.front()) : Expected<Uri, SetupError>(Uri());
  if (uri && uri->scheme == "replay" && !uri->options.contains("probe") &&
      !split_fragment(uri->text).second && SessionSamples::is_session(uri->path)) {
    const auto session = SessionReader::open(uri->path);
    if (!session) return Unexpected<SetupError>(session.error());
    const std::size_t held = session->facts("probe").size();
    if (held != wanted) {
      return bad_input("\"" + uri->text + "\" holds the samples of " + std::to_string(held) +
                       (held == 1 ? " probe" : " probes") + ", but the scene has " +
                       std::to_string(wanted) + ": give a URI for each, such as " + uri->text +
                       (uri->options.empty() ? "?" : "&") + "probe=0 for the first");
    }
    uris.assign(wanted, uri->text + (uri->options.empty() ? "?" : "&") + "probe=");
    for (std::size_t i = 0; i < wanted; ++i) uris[i] += std::to_string(i);
  }
  return scene.set_probes(uris);
}

Expected<RunDescription, SetupError> describe_session(const std::string& path,
                                                      const SessionReader& session,
                                                      const Scene* scene) {
  RunDescription run;
  if (scene != nullptr) {
    run.model = scene->model;
    run.encoding = scene->encoding;
  }
  run.scene = session.fact("scene");
  run.facts = session.facts();
  std::erase_if(run.facts, [](const auto& fact) { return fact.first == "scene"; });
  auto probes = probes_of_session(path);
  if (!probes) return Unexpected<SetupError>(probes.error());
  run.probes = std::move(*probes);
  return run;
}

bool SessionNumbering::needed(const SessionReader& session) {
  return session.fact(kNumbering) != kThroughPatches;
}

SessionNumbering::SessionNumbering(const SessionReader& session, const TactileModel& model) {
  if (!needed(session)) return;
  std::uint32_t before = 0;
  for (const TactilePatch& patch : model.patches()) {
    before_patch_.push_back(before);
    before += static_cast<std::uint32_t>(patch.neurons());
  }
}

void SessionNumbering::apply(SessionChunk& chunk) const {
  for (SpikeEvent& spike : chunk.spikes) {
    if (spike.patch < before_patch_.size()) spike.neuron += before_patch_[spike.patch];
  }
}

Expected<Scene, SetupError> scene_of_session(const SessionReader& session) {
  if (session.fact("scene_text").empty()) {
    return bad_input(
        "the session was recorded without a simulation: only sessions of merkel run hold a scene");
  }
  const std::string name = session.fact("scene");
  auto scene = parse_scene(session.fact("scene_text"), name.empty() ? "the session's scene" : name,
                           session.facts(kShapeFact));
  if (!scene) return scene;
  const std::string controls = session.fact("controls");
  if (controls.empty() || controls.size() > kMaxProbes ||
      controls.find_first_not_of("df") != std::string::npos) {
    return bad_input("the session lacks the channels of its probes: it is damaged");
  }
  auto& indenters = scene->model.indenters;
  indenters.resize(controls.size(), indenters.back());
  scene->probes.resize(controls.size(), scene->probes.back());
  for (std::size_t i = 0; i < controls.size(); ++i) {
    indenters[i].control =
        controls[i] == 'd' ? Indenter::Control::kDepth : Indenter::Control::kForce;
  }
  // The command line may have set seeds that differ from the scene's.
  for (const NamedSeed& each : seeds_of(scene->model)) {
    if (each.value == nullptr) continue;
    const auto seed = parsed_number<std::uint64_t>(session.fact(each.name));
    if (!seed) return bad_input("the session lacks its seeds: it is damaged");
    *each.value = *seed;
  }
  const std::vector<std::string> receptor_seeds = session.facts("receptor_seed");
  if (receptor_seeds.size() != scene->model.patches.size()) {
    return bad_input("the session lacks its seeds: it is damaged");
  }
  for (std::size_t i = 0; i < receptor_seeds.size(); ++i) {
    const auto seed = parsed_number<std::uint64_t>(receptor_seeds[i]);
    if (!seed) return bad_input("the session lacks its seeds: it is damaged");
    scene->model.patches[i].receptors.seed = *seed;
  }
  // A plan may have chosen a method other than that of the scene's text.
  if (auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&scene->model.afferent)) {
    if (const auto method = integration_method_named(session.fact("method"))) {
      paper->method = *method;
    }
    paper->precision = session.fact("precision") == name_of(Precision::kFloat) ? Precision::kFloat
                                                                               : Precision::kDouble;
  }
  if (const auto step = parsed_number<std::uint64_t>(session.fact("step_ns")); step && *step > 0) {
    scene->model.step = std::chrono::nanoseconds{static_cast<std::int64_t>(*step)};
  }
  return scene;
}

}  // namespace merkel
