#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/limited_probe.hpp"
#include "realtime/input/probe_input.hpp"
#include "tools/scene/loop_settings.hpp"

namespace merkel {

/// The complete description of a run, as in a scene file.
struct Scene {
  /// A device that feeds several probes.
  struct OfDevice {
    std::string name;
    std::string uri;

    [[nodiscard]] static FieldTable fields();
  };
  struct ProbeSettings {
    std::string uri;                    ///< empty: that of the device
    std::optional<std::size_t> device;  ///< number in `devices`
    /// The channels of the device that are its readings, as ChannelSelection describes; empty:
    /// none.
    std::string force, depth, x, y;
    std::string calibration;     ///< file; empty: none
    std::string taxel_channels;  ///< how the names of an array's channels begin
    std::optional<std::chrono::nanoseconds> delay = {};
    ProbeInput::Parameters input = {};
    PressLimits limits;
    /// The reading that drives the contact; default: by the probe's channels.
    std::optional<Indenter::Control> control = {};

    [[nodiscard]] static FieldTable fields();
  };
  TactileModel::Parameters model;
  EncodingParameters encoding;  ///< no electrodes: no stimulation commands
  std::vector<OfDevice> devices;
  std::vector<ProbeSettings> probes;
  std::vector<std::string> sinks;
  LoopSettings loop;
  /// Largest rms error of spike times; the plan chooses a method that meets it.
  std::optional<double> spike_time_us;
  std::string file;                              ///< empty for a preset
  std::string preset;                            ///< source of the defaults
  std::string text;                              ///< parse_scene reconstructs the scene from it
  std::map<std::string, std::uint32_t> line_of;  ///< line of each key in the file

  /// Where a probe gets its samples: its device, and the channels of the device that are its
  /// readings.
  [[nodiscard]] Expected<DeviceUri, SetupError> source_of(std::size_t probe) const;
  /// The same as a URI, for display.
  [[nodiscard]] std::string uri_of(std::size_t probe) const;
  /// Sets the probes; additional ones copy the settings of the scene's last probe. Fails with the
  /// scene's probes if there are fewer URIs.
  [[nodiscard]] Expected<void, SetupError> set_probes(const std::vector<std::string>& uris);
  /// Puts each tactile array where its probe is.
  void place_arrays();
  /// Sets all seeds: the network's, and that of each patch, increasing by one.
  void set_seed(std::uint64_t seed);
  /// "file:line: key reason", for the user.
  [[nodiscard]] std::string sentence(const ParameterError& error) const;
};

/// For a skin.radius_mm that is set without skin.radius_along_mm: infinite means flat skin,
/// whatever radius the preset has along the finger.
void flatten_if_infinite(SkinParameters& skin);

/// Reads a scene. Every key is optional; its default is that of the preset in the key `preset`, or
/// of "paper". Fails with file, line and advice on an unknown key (with the nearest known one) or a
/// wrong type. TactileModel::create checks the values.
[[nodiscard]] Expected<Scene, SetupError> read_scene(const std::string& path);
/// The same from the text of a scene; `name` stands for the file in messages. \param shapes  the
/// heights of its measured shapes (heights_of), instead of their files
[[nodiscard]] Expected<Scene, SetupError> parse_scene(const std::string& text,
                                                      const std::string& name,
                                                      const std::vector<std::string>& shapes = {});
/// The heights of the scene's measured shapes (csv_heights), in the order of the probes; empty
/// where the file is still to be read.
[[nodiscard]] std::vector<std::string> heights_of(const Scene& scene);

}  // namespace merkel
