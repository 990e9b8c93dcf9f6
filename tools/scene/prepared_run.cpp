#include "tools/scene/prepared_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/limited_probe.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/sinks/recording_switch.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/run_probes.hpp"
#include "tools/scene/machine_facts.hpp"
#include "tools/scene/pressed_cost.hpp"
#include "tools/scene/scene_encoder.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// Threads that spin on all cores starve the sinks, the system and other programs.
std::string leave_one_core(LoopSettings& loop) {
  if (loop.threads <= 1 || loop.threads != SpinningTeam::available_cores()) return {};
  const std::string all = std::to_string(loop.threads--);
  return "loop.threads = " + all + " is reduced to " + std::to_string(loop.threads) +
         ": one of this machine's cores is left to other threads; the spikes are the same";
}

/// Everything that a model is made of: the scene's keys and the readings that drive its contacts.
std::string model_key_of(const Scene& scene) {
  std::string key = scene_text(scene);
  for (const Indenter& indenter : scene.model.indenters) {
    key += indenter.control == Indenter::Control::kDepth ? 'd' : 'f';
  }
  return key;
}

/// Scenes of Python were read before the run that they make.
void note_files_of(const Scene& scene) {
  ReadFiles::note(scene.file);
  for (const Indenter& indenter : scene.model.indenters) {
    if (const auto* shape = std::get_if<ShapeTip>(&indenter.tip)) ReadFiles::note(shape->file);
  }
}

/// The longest delay of the scene's probes.
std::optional<nanoseconds> delay_of(const Scene& scene) {
  std::optional<nanoseconds> delay;
  for (const Scene::ProbeSettings& probe : scene.probes) {
    if (probe.delay) delay = std::max(delay.value_or(nanoseconds{0}), *probe.delay);
  }
  return delay;
}

/// A calibration that leaves out what drives the model; empty: there is none, or it does not.
std::string uncalibrated_drive(const ProbeInfo& info, const Scene::ProbeSettings& probe) {
  const bool has_force = (info.channels & ProbeSample::kForce) != 0U;
  const bool force = probe.control ? *probe.control == Indenter::Control::kForce : has_force;
  const std::uint32_t driving = force ? ProbeSample::kForce : ProbeSample::kDepth;
  if (info.calibrated == 0 || (info.calibrated & driving) != 0U) return {};
  const std::string name = force ? "force" : "depth";
  const bool fused = info.uri.starts_with("fused:");
  return info.calibration_file + " does not calibrate the " + name +
         ", which drives the model: it is used as the device sends it; " +
         (fused ? "calibrate the member that measures it by merkel calibrate"
                : "add it by merkel calibrate '" + info.uri + "' " + info.calibration_file +
                      " --channel " + name);
}

/// Opens each device once: probes whose URIs differ only in what follows '#' share one.
Expected<std::vector<PreparedRun::Device>, SetupError> open_devices(const Scene& scene,
                                                                    bool allow_remote) {
  std::vector<DeviceUri> uris;
  std::vector<PreparedRun::Device> devices;
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    auto source = scene.source_of(i);
    if (!source) return Unexpected<SetupError>(source.error());
    DeviceUri& uri = *source;
    uri.allow_remote = allow_remote;
    const auto same = std::find_if(uris.begin(), uris.end(), [&](const DeviceUri& other) {
      return other.uri == uri.uri && !other.parts.empty() && !uri.parts.empty();
    });
    if (same == uris.end()) {
      uris.push_back(std::move(uri));
      devices.push_back({.probe = nullptr, .feeds = {i}});
      continue;
    }
    same->parts.push_back(std::move(uri.parts.front()));
    same->calibrations.push_back(std::move(uri.calibrations.front()));
    devices[static_cast<std::size_t>(same - uris.begin())].feeds.push_back(i);
  }
  for (std::size_t k = 0; k < uris.size(); ++k) {
    auto probe = open_device(uris[k]);
    if (!probe) return Unexpected<SetupError>(probe.error());
    devices[k].probe = std::move(*probe);
  }
  return devices;
}

/// Refuses probes for which the machine has no memory, and reports the cost of many. Each device
/// has a thread, and each probe a queue of samples.
Expected<std::string, SetupError> cost_of(std::size_t devices,
                                          const std::vector<ProbeInfo>& probes) {
  constexpr std::size_t kMany = 256;  ///< threads
  std::size_t bytes = 0;
  for (const ProbeInfo& probe : probes) bytes += RunProbes::queue_bytes(probe);
  const auto pages = static_cast<std::size_t>(std::max(::sysconf(_SC_PHYS_PAGES), 0L));
  const std::size_t memory = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const auto in_GB = [](std::size_t size) {
    return shortest_decimal(std::round(static_cast<double>(size) * 1e-8) / 10.0) + " GB";
  };
  const std::string cost = std::to_string(probes.size()) + " probes on " + std::to_string(devices) +
                           " devices take " + std::to_string(devices) + " threads and " +
                           in_GB(bytes) + " for their samples";
  if (bytes > memory / 2) {
    return unavailable(cost + ", but this machine has " + in_GB(memory) +
                       " of memory: use fewer probes or a lower rate");
  }
  if (devices < kMany) return std::string();
  return cost + "; channels of one device ([[device]]) share its thread";
}

}  // namespace

std::unique_ptr<TactileModel> ModelCache::take(const std::string& key) {
  const std::lock_guard lock(mutex_);
  if (key != key_ || !model_) return nullptr;
  model_->reset();
  return std::move(model_);
}

void ModelCache::keep(std::string key, std::unique_ptr<TactileModel> model) {
  const std::lock_guard lock(mutex_);
  key_ = std::move(key);
  model_ = std::move(model);
  if (model_) model_->share_work(nullptr);
}

namespace {

/// Whether a probe can feed a tip: an array needs its pressures.
Expected<void, SetupError> check_array(const Indenter& tip, const ProbeInfo& probe) {
  if (tip.taxels() != nullptr && probe.taxels != tip.taxels()->size()) {
    return bad_input("the probe " + probe.uri + " has " + std::to_string(probe.taxels) +
                     " taxels, but the tip of the scene " + std::to_string(tip.taxels()->size()) +
                     ": use the same number (taxel_columns, taxel_rows)");
  }
  if (tip.taxels() == nullptr && probe.taxels > 0) {
    return bad_input("the probe " + probe.uri + " is a tactile array of " +
                     std::to_string(probe.taxels) +
                     " taxels: set tip = \"taxels\" in [probe], with taxel_columns and taxel_rows");
  }
  return {};
}

}  // namespace

Expected<void, SetupError> choose_controls(Scene& scene, const std::vector<ProbeInfo>& probes) {
  const bool force = std::all_of(probes.begin(), probes.end(), [](const ProbeInfo& probe) {
    return (probe.channels & ProbeSample::kForce) != 0U;
  });
  scene.place_arrays();
  for (std::size_t i = 0; i < probes.size(); ++i) {
    if (auto checked = check_array(scene.model.indenters[i], probes[i]); !checked) return checked;
    if (probes[i].taxels > 0) {
      scene.model.indenters[i].control = Indenter::Control::kForce;
      continue;
    }
    const bool depth = (probes[i].channels & ProbeSample::kDepth) != 0U;
    if ((probes[i].channels & (ProbeSample::kForce | ProbeSample::kDepth)) == 0U &&
        !probes[i].extra_columns.empty()) {
      return bad_input("the probe " + probes[i].uri + ": " +
                       no_press_among(probes[i].extra_columns));
    }
    const auto usual = force || !depth ? Indenter::Control::kForce : Indenter::Control::kDepth;
    const auto control = scene.probes[i].control.value_or(usual);
    const bool by_depth = control == Indenter::Control::kDepth;
    if ((probes[i].channels & (by_depth ? ProbeSample::kDepth : ProbeSample::kForce)) == 0U) {
      return bad_input("probe.control is set to " + std::string(by_depth ? "depth" : "force") +
                       ", which the probe " + probes[i].uri +
                       " does not measure: change probe.control");
    }
    scene.model.indenters[i].control = scene.probes[i].input.contact.control = control;
  }
  return {};
}

Expected<Simulation, SetupError> make_simulation(Scene& scene, const std::vector<ProbeInfo>& probes,
                                                 const RealtimeSettings& workers,
                                                 ModelCache* models) {
  if (auto chosen = choose_controls(scene, probes); !chosen) {
    return Unexpected<SetupError>(chosen.error());
  }
  Simulation simulation;
  if (models != nullptr) {
    simulation.model_key = model_key_of(scene);
    simulation.model = models->take(simulation.model_key);
  }
  if (!simulation.model) {
    auto model = TactileModel::create(scene.model);
    if (!model) return bad_input(scene.sentence(model.error()));
    simulation.model = std::make_unique<TactileModel>(std::move(*model));
  }
  auto encoder = encoder_of(scene, *simulation.model);
  if (!encoder) return Unexpected<SetupError>(encoder.error());
  auto team = SpinningTeam::create(
      scene.loop.threads, [workers](int worker) { set_up_worker_thread(workers, worker); });
  if (!team) return Unexpected<SetupError>(team.error());
  simulation.encoder = std::move(*encoder);
  simulation.team = std::move(*team);
  if (scene.loop.threads > 1) simulation.model->share_work(simulation.team.get());
  return simulation;
}

void PreparedRun::add_probes_to(Pipeline& pipeline) {
  for (Device& device : devices) {
    std::vector<RunInput> inputs;
    for (const std::size_t i : device.feeds) {
      inputs.push_back({.probe = i, .parameters = scene.probes[i].input});
    }
    pipeline.add_device(std::move(device.probe), inputs);
  }
  devices.clear();
}

Expected<std::unique_ptr<Pipeline>, SetupError> PreparedRun::pipeline_to(
    const std::vector<std::string>& sinks, SinkSetup setup,
    const std::function<void(const std::string&)>& on_address) {
  const auto tick = model->parameters().tick;
  if (parameters.duration && *parameters.duration < tick) {
    return bad_input("a run of " + shortest_decimal(units::s_from(*parameters.duration)) +
                     " s is shorter than a tick of " + shortest_decimal(units::s_from(tick)) +
                     " s: nothing would be simulated");
  }
  auto pipeline = std::make_unique<Pipeline>(*model, parameters);
  add_probes_to(*pipeline);
  setup.neurons = static_cast<std::uint32_t>(model->neurons());
  setup.run = description;
  setup.notice = parameters.on_notice;
  auto opened = open_sinks(sinks, setup);
  if (!opened) return Unexpected<SetupError>(opened.error());
  for (auto& sink : *opened) {
    const std::string address = sink->address();
    if (!address.empty() && on_address) on_address(address);
    pipeline->add_sink(std::move(sink));
  }
  if (setup.recording != nullptr && setup.recording->offered()) {
    pipeline->add_sink(session_on_request(setup.recording, setup));
  }
  return pipeline;
}

Expected<RunReport, SetupError> PreparedRun::run(const std::vector<std::string>& sinks,
                                                 SinkSetup setup) {
  const auto pipeline = pipeline_to(sinks, std::move(setup));
  if (!pipeline) return Unexpected<SetupError>(pipeline.error());
  return (*pipeline)->run();
}

Expected<PreparedRun, SetupError> prepare_run(Scene scene, RunPreparation preparation) {
  for (const Electrode& each : scene.encoding.electrodes) {
    if (each.encoder != EncoderKind::kOwn || preparation.gives_drives) continue;
    return bad_input(
        "the electrode " + each.name +
        " has encoder = \"own\", whose drives come from set_drive() in Python "
        "(merkel.connect, scene.stream); this run has none: choose another encoder, or repeat a "
        "recorded run with merkel replay SESSION");
  }
  PreparedRun run;
  note_files_of(scene);
  if (auto notice = leave_one_core(scene.loop); !notice.empty()) {
    run.notices.push_back(std::move(notice));
  }
  for (std::size_t i = 0; i < preparation.probes.size(); ++i) {
    run.devices.push_back({.probe = std::move(preparation.probes[i]), .feeds = {i}});
  }
  if (run.devices.empty()) {
    auto opened = open_devices(scene, preparation.allow_remote);
    if (!opened) return Unexpected<SetupError>(opened.error());
    run.devices = std::move(*opened);
  }
  std::vector<ProbeInfo> infos(scene.probes.size());
  for (PreparedRun::Device& device : run.devices) {
    std::vector<PressLimits> limits;
    for (std::size_t output = 0; output < device.feeds.size(); ++output) {
      infos[device.feeds[output]] = device.probe->outputs()[output];
      limits.push_back(scene.probes[device.feeds[output]].limits);
    }
    device.probe = std::make_unique<LimitedProbe>(std::move(device.probe), std::move(limits));
  }
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (auto notice = uncalibrated_drive(infos[i], scene.probes[i]); !notice.empty()) {
      run.notices.push_back(std::move(notice));
    }
  }
  auto cost = cost_of(run.devices.size(), infos);
  if (!cost) return Unexpected<SetupError>(cost.error());
  if (!cost->empty()) run.notices.push_back(std::move(*cost));
  auto simulation = make_simulation(
      scene, infos, preparation.fast ? RealtimeSettings{.fifo = false} : scene.loop.realtime,
      preparation.models);
  if (!simulation) return Unexpected<SetupError>(simulation.error());
  static_cast<Simulation&>(run) = std::move(*simulation);
  if (!preparation.fast) {
    std::vector<ContactInput> places;
    for (const Scene::ProbeSettings& probe : scene.probes) {
      places.push_back({.x_mm = probe.input.x_mm, .y_mm = probe.input.y_mm});
    }
    const nanoseconds pressed = pressed_cost(*run.model, places, &PeriodicClock::now);
    if (auto warning = cost_warning(pressed, scene.model.tick); !warning.empty()) {
      run.notices.push_back(std::move(warning));
    }
  }
  run.parameters = {.fast = preparation.fast,
                    .delay = delay_of(scene),
                    .duration = std::nullopt,
                    .max_catch_up_ticks = scene.loop.max_catch_up_ticks,
                    .wait = scene.loop.wait,
                    .realtime = scene.loop.realtime,
                    .encoder = run.encoder.get(),
                    .team = run.team.get()};
  run.description = describe_run(scene, *run.model);
  if (!preparation.fast) {
    for (auto& fact : utc_facts()) run.description.facts.push_back(std::move(fact));
  }
  for (const ProbeInfo& info : infos) add_probe_facts(info, run.description);
  run.scene = std::move(scene);
  return run;
}

}  // namespace merkel
