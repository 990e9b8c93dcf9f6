#pragma once

#include <chrono>
#include <span>
#include <vector>

#include "core/expected.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/probe_sample.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probe.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// The contacts of a scene's probes, tick by tick.
struct Rehearsal {
  struct Tick {
    std::vector<ContactInput> contacts;           ///< one per indenter
    std::vector<std::vector<float>> taxels = {};  ///< of each, kPa; empty: no tactile array
  };
  std::vector<Tick> ticks;
  std::chrono::nanoseconds tick{0};
  std::size_t untouched = 0;  ///< ticks without contact
};

/// The samples of a scene's probes around the first touch, for use with any tick.
class ProbeRecording {
 public:
  /// Reads recorded and simulated probes and chooses what drives `scene`'s contacts, as a run does.
  /// Fails if one cannot be opened, or ends with an error, as at a press beyond its limits.
  /// \param most  longest duration, from shortly before the first touch
  [[nodiscard]] static Expected<ProbeRecording, SetupError> read(Scene& scene,
                                                                 std::chrono::nanoseconds most);

  /// The contacts at the ends of the ticks. Ticks that divide the scene's tick share its grid,
  /// which starts at the first sample as in a run.
  [[nodiscard]] Rehearsal at(std::chrono::nanoseconds tick) const;
  /// True if a ramp-and-hold of 0.45 N or 1.5 mm, in the channels that its URI states (for a
  /// tactile array, a rolling ball), replaces a device, which cannot be read in advance.
  [[nodiscard]] bool stand_in() const noexcept { return stand_in_; }

 private:
  struct Recorded {
    ProbeSample sample;
    std::vector<float> taxels = {};
  };
  static Expected<std::vector<Recorded>, SetupError> samples_of(
      Probe& probe, const ContactDecision::Parameters& parameters, std::chrono::nanoseconds most);

  std::vector<std::vector<Recorded>> samples_;  ///< by probe
  std::vector<ProbeInput::Parameters> inputs_;
  std::chrono::nanoseconds start_{0};
  std::chrono::nanoseconds end_{0};
  bool stand_in_ = false;
};

/// One tick of a rehearsal, from `start`. \return its spikes
std::span<SpikeEvent> step(TactileModel& model, const Rehearsal::Tick& tick,
                           std::chrono::nanoseconds start);

/// All spikes of a model, from rest, under a rehearsal's contacts. Both must have the same tick.
[[nodiscard]] std::vector<SpikeEvent> run_through(TactileModel& model, const Rehearsal& rehearsal);

}  // namespace merkel
