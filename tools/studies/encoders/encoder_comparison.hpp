#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/tick_record.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// What one encoder makes of a touch.
struct EncodedTouch {
  std::string encoder;
  std::vector<Electrode> electrodes;
  std::vector<std::chrono::nanoseconds> phases;  ///< first phases, by electrode
  std::chrono::nanoseconds tick{1'000'000};
  std::vector<StimulationCommand> commands;
  std::vector<SpikeEvent> spikes;
  std::vector<TickRecord> ticks;  ///< one per probe and tick
};

/// Figures of one encoder. Charge is that of the first phases, over all electrodes.
struct EncoderFigures {
  std::string encoder;
  double charge_uC = 0.0;
  double peak_uA = 0.0;        ///< of one electrode
  double peak_total_uA = 0.0;  ///< of all at once: trains, and the pulses of a tick
  /// Charge per second in the first 100 ms of a touch over that from 200 ms on, mean of the touches
  /// of at least 400 ms; NaN if there is none, or none that stimulates from 200 ms on.
  double onset_ratio = 0.0;
  /// Of charge per second with the rate of all afferents, in bins of 50 ms; NaN if one is constant.
  double rate_correlation = 0.0;
};

/// Encodes the touch of a scene's probes with an encoder for all its electrodes and groups. Fails
/// if the encoder does not exist or does not fit the scene. Real-time: no.
/// \param encoder  as in the key `encoder`
[[nodiscard]] Expected<EncodedTouch, SetupError> encode_touch(Scene scene,
                                                              const std::string& encoder);

[[nodiscard]] EncoderFigures figures_of(const EncodedTouch& touch);

/// Charge per second in bins of equal width from the first tick on, µC/s.
[[nodiscard]] std::vector<double> charge_rate(const EncodedTouch& touch,
                                              std::chrono::nanoseconds bin);

/// The names of all encoders.
[[nodiscard]] std::vector<std::string> encoder_names();

}  // namespace merkel
