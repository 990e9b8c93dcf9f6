#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probes/limited_probe.hpp"
#include "realtime/input/probe_input.hpp"
#include "tools/scene/loop_settings.hpp"

namespace merkel {

/// Everything a run needs to know, as a scene file says it.
struct Scene {
  struct OfProbe {
    std::string uri;
    std::optional<std::chrono::nanoseconds> delay;
    ProbeInput::Parameters input;
    PressLimits limits;
    /// Which reading drives the contact; as the probe's channels suggest, if not set.
    std::optional<Indenter::Control> control;

    [[nodiscard]] static FieldTable fields();
  };
  TactileModel::Parameters model;
  EncodingParameters encoding;  ///< without electrodes: no stimulation commands
  std::vector<OfProbe> probes;
  std::vector<std::string> sinks;
  LoopSettings loop;
  /// Largest rms error of spike times; the plan picks a method that meets it.
  std::optional<double> spike_time_us;
  std::string file;                              ///< empty for a preset
  std::string preset;                            ///< from which the defaults come
  std::string text;                              ///< from which parse_scene makes it again
  std::string notice;                            ///< for the user; empty: none
  std::map<std::string, std::uint32_t> line_of;  ///< where each key stands in the file

  /// Takes these probes; further ones are like the scene's last.
  void set_probes(const std::vector<std::string>& uris);
  /// Seeds everything that is drawn: the network, and the patches each with one more.
  void set_seed(std::uint64_t seed);
  /// "file:line: key reason", for a person.
  [[nodiscard]] std::string sentence(const ParameterError& error) const;
};

/// Reads a scene; every key is optional and has the default of the preset that the key `preset`
/// names, "paper" if none. Fails with file, line and what to fix on an unknown key (naming the
/// nearest known one) or a wrong type; values are judged by TactileModel::create.
[[nodiscard]] Expected<Scene, SetupError> read_scene(const std::string& path);
/// The same from the text of a scene; `name` stands for the file in messages.
[[nodiscard]] Expected<Scene, SetupError> parse_scene(const std::string& text,
                                                      const std::string& name);

}  // namespace merkel
