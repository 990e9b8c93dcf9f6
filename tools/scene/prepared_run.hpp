#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/expected.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probe.hpp"
#include "drivers/sink_setup.hpp"
#include "realtime/pipeline.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "realtime/threads/thread_setup.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// Keeps the model of a finished run for the next run of the same scene: building one takes longer
/// than simulating a short press. The spikes are those of a new model. A copy is empty. Thread:
/// any.
class ModelCache {
 public:
  ModelCache() = default;
  ModelCache(const ModelCache& /*other*/) : ModelCache() {}
  ModelCache& operator=(const ModelCache& /*other*/) { return *this; }

  /// The model made for `key`, at rest; null if there is none.
  [[nodiscard]] std::unique_ptr<TactileModel> take(const std::string& key);
  void keep(std::string key, std::unique_ptr<TactileModel> model);

 private:
  std::mutex mutex_;
  std::string key_;
  std::unique_ptr<TactileModel> model_;
};

/// The model and loop settings of a scene.
struct Simulation {
  std::unique_ptr<TactileModel> model;
  std::string model_key;                        ///< of the model in a cache; empty without a cache
  std::unique_ptr<StimulationEncoder> encoder;  ///< null: the scene has no electrodes
  std::unique_ptr<SpinningTeam> team;           ///< shares the work of a tick
};

/// Chooses the reading that drives each contact and builds what simulates the scene.
/// \param probes   one per indenter; uses channels and URI
/// \param workers  of the threads of the team
/// \param models   may hold the model; null: none
/// Returns the first error as a sentence. Real-time: no.
[[nodiscard]] Expected<Simulation, SetupError> make_simulation(Scene& scene,
                                                               const std::vector<ProbeInfo>& probes,
                                                               const RealtimeSettings& workers,
                                                               ModelCache* models = nullptr);

/// A scene prepared to run: its simulation and its probes.
///
/// \code
///   auto run = prepare_run(*preset_scene("goodwin"), {.fast = true});
///   const auto report = run->run({"csv:spikes.csv"}, {.overwrite = true});
/// \endcode
struct PreparedRun : Simulation {
  Scene scene;  ///< including the chosen controls
  /// A device and the probes that it feeds, one for each of its outputs.
  struct Device {
    std::unique_ptr<Probe> probe;
    std::vector<std::size_t> feeds;
  };
  std::vector<Device> devices;       ///< each indenter is fed by one
  Pipeline::Parameters parameters;   ///< the caller adds callbacks
  RunDescription description;        ///< for sinks
  std::vector<std::string> notices;  ///< for the user

  /// Moves the devices into a pipeline. Call once.
  void add_probes_to(Pipeline& pipeline);
  /// Makes a pipeline of the devices and the sinks of URIs, in order, and of a session on request
  /// if one of them offers it. Call once. Fails if a sink cannot be opened.
  /// \param setup       neurons, description and notice are set to those of the run
  /// \param on_address  called with the address of each sink that has one; may be empty
  [[nodiscard]] Expected<std::unique_ptr<Pipeline>, SetupError> pipeline_to(
      const std::vector<std::string>& sinks, SinkSetup setup,
      const std::function<void(const std::string&)>& on_address = {});
  /// Runs to the end of the streams; as pipeline_to() and Pipeline::run().
  [[nodiscard]] Expected<RunReport, SetupError> run(const std::vector<std::string>& sinks,
                                                    SinkSetup setup = {});
};

struct RunPreparation {
  bool fast = false;          ///< virtual clock; recordings only
  bool allow_remote = false;  ///< as in open_probe()
  bool gives_drives = false;  ///< the caller calls Pipeline::give_drive()
  /// Replace the scene's probes; one per indenter.
  std::vector<std::unique_ptr<Probe>> probes = {};
  ModelCache* models = nullptr;  ///< may hold the model of an earlier run; borrowed
};

/// Opens the scene's probes, chooses the reading that drives each contact and builds the model.
/// Returns the first error as a sentence. Real-time: no.
[[nodiscard]] Expected<PreparedRun, SetupError> prepare_run(Scene scene,
                                                            RunPreparation preparation);

/// Selects the reading that drives each contact: the scene's choice, else force if every probe
/// measures it, else depth. Force is measured at the skin; the depth at that force depends on the
/// finger and on the zero of the stage.
/// \param probes  one per indenter; uses channels and URI. Fails if a probe does not measure what
/// the scene selects.
[[nodiscard]] Expected<void, SetupError> choose_controls(Scene& scene,
                                                         const std::vector<ProbeInfo>& probes);

}  // namespace merkel
