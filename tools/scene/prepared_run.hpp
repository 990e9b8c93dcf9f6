#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/expected.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probe.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "realtime/pipeline.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// A scene made ready to run: its model, its probes, and the threads that share the work of a tick.
///
/// \code
///   auto run = prepare_run(*preset_scene("goodwin"), {.fast = true});
///   Pipeline pipeline(*run->model, run->parameters);
///   run->add_probes_to(pipeline);
///   pipeline.add_sink(…);
///   const auto report = pipeline.run();
/// \endcode
struct PreparedRun {
  Scene scene;  ///< with the controls that were chosen
  std::unique_ptr<TactileModel> model;
  std::unique_ptr<StimulationEncoder> encoder;  ///< null: the scene has no electrodes
  std::unique_ptr<SpinningTeam> team;
  std::vector<std::unique_ptr<Probe>> probes;  ///< one an indenter
  Pipeline::Parameters parameters;             ///< callbacks are the caller's to add
  RunDescription description;                  ///< for sinks
  std::string notice;                          ///< for the user; empty: none

  /// Hands the probes over. Call once.
  void add_probes_to(Pipeline& pipeline);
};

struct RunPreparation {
  bool fast = false;  ///< virtual clock; recordings only
  /// In place of the probes that the scene names, one an indenter.
  std::vector<std::unique_ptr<Probe>> probes = {};
};

/// Opens the scene's probes, chooses the reading that drives each contact and builds the model.
/// Fails with the sentence of the first thing that is wrong. Real-time: no.
[[nodiscard]] Expected<PreparedRun, SetupError> prepare_run(Scene scene,
                                                            RunPreparation preparation);

/// Chooses the reading that drives each contact: what the scene requests, else the force where
/// every probe measures it, else the depth. A force is measured at the skin; the depth that goes
/// with it depends on the finger, and on where the stage was zeroed.
/// \param probes  one an indenter, of which channels and URI are used. Fails where a probe does not
/// measure what the scene requests.
[[nodiscard]] Expected<void, SetupError> choose_controls(Scene& scene,
                                                         const std::vector<ProbeInfo>& probes);

}  // namespace merkel
