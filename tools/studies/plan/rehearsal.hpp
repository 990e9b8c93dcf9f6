#pragma once

#include <chrono>
#include <vector>

#include "core/expected.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/probe_sample.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// What a scene's probes do for a while, tick by tick.
struct Rehearsal {
  std::vector<std::vector<ContactInput>> ticks;  ///< of each tick: one contact an indenter
  std::chrono::nanoseconds tick{0};
  std::size_t untouched = 0;  ///< ticks in which no probe touches
};

/// The samples of a scene's probes around the first touch, to be read at any tick.
class ProbeRecording {
 public:
  /// Reads recorded and simulated probes; `scene`'s indenters get their control. Fails where one
  /// cannot be opened. \param most  how long from shortly before the first touch on, at most
  [[nodiscard]] static Expected<ProbeRecording, SetupError> read(Scene& scene,
                                                                 std::chrono::nanoseconds most);

  /// The contacts at the ends of the ticks. Ticks that divide the scene's own share its grid, which
  /// is that of a run: it begins at the first sample.
  [[nodiscard]] Rehearsal at(std::chrono::nanoseconds tick) const;
  /// A device cannot be asked beforehand: a 1.5 mm ramp-and-hold stands in for it.
  [[nodiscard]] bool stand_in() const noexcept { return stand_in_; }

 private:
  std::vector<std::vector<ProbeSample>> samples_;  ///< by probe
  std::vector<ProbeInput::Parameters> inputs_;
  std::chrono::nanoseconds start_{0};
  std::chrono::nanoseconds end_{0};
  bool stand_in_ = false;
};

/// All spikes of a model, from rest, as a rehearsal's probes press it; the rehearsal's tick is the
/// model's.
[[nodiscard]] std::vector<SpikeEvent> run_through(TactileModel& model, const Rehearsal& rehearsal);

}  // namespace merkel
