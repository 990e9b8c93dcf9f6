#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/encoded_model.hpp"
#include "core/encoding/encoding_parameters.hpp"
#include "core/encoding/field_activity.hpp"
#include "core/encoding/field_touch.hpp"
#include "core/encoding/group_pulses.hpp"
#include "core/encoding/stimulation_limiter.hpp"
#include "core/encoding/stimulator_profile.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_state.hpp"
#include "core/records/given_drive.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/tick_record.hpp"

namespace merkel {

/// Converts a model's touch to stimulation commands, one tick at a time: encoders, then one
/// limiter, then the steps of the stimulator.
///
/// Research software: it does not drive an implant by itself, and nothing here makes a stimulation
/// safe.
///
/// A fault sets the amplitude of every electrode of the patch to 0, in a separate update at the end
/// of the same tick, and clears the encoders' history. Construct, reset, step: create() allocates
/// all memory. Deterministic: the same ticks give the same bits.
class StimulationEncoder {
 public:
  using Stop = StimulationCommand::Stop;

  /// The output of the model for one tick.
  struct Tick {
    std::span<const TickRecord> records;  ///< one per probe, all with the same end
    std::span<const Press> presses;       ///< one per probe
    std::span<const SpikeEvent> spikes;   ///< in order of time
    std::span<const SpikeEvent> resets;   ///< neurons reset
  };

  /// Fails with the first invalid parameter, or if an electrode names something that the model
  /// lacks. Real-time: no.
  [[nodiscard]] static Expected<StimulationEncoder, ParameterError> create(
      const EncodingParameters& parameters, const EncodedModel& model);

  /// Switches everything off and clears the history. Real-time: yes.
  void reset() noexcept MERKEL_REALTIME;

  /// Takes the drive of an electrode whose encoder is `own`, and of its group. It holds from the
  /// tick that ends at its time until the watchdog expires; without one, the electrode is off.
  /// Others are ignored. Real-time: yes.
  void set_drive(const GivenDrive& given) noexcept MERKEL_REALTIME;

  /// Processes the next tick. A tick that does not follow its predecessor is a gap.
  /// \return its commands in order of time, valid until the next call.  Real-time: yes.
  std::span<const StimulationCommand> step(const Tick& tick) noexcept MERKEL_REALTIME;

  /// Keeps all electrodes off from the next tick on, until reset(). Real-time: yes.
  void fail_safe(Stop stop) noexcept MERKEL_REALTIME { latched_ = stop; }

  /// The last update of a run, at the end of the last tick: everything is off. Empty if there was
  /// no tick. Real-time: yes.
  std::span<const StimulationCommand> finish() noexcept MERKEL_REALTIME;

  [[nodiscard]] const EncodingParameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] const StimulationLimiter::Clippings& clippings() const noexcept {
    return limiter_.clippings();
  }
  /// What rounding to the steps of the stimulator has taken away.
  [[nodiscard]] const StimulatorSteps::Counts& rounding() const noexcept { return steps_.counts(); }
  /// How often a fault has switched off one patch or all patches, since construction.
  [[nodiscard]] std::uint64_t stops() const noexcept { return stops_; }
  /// Number of afferents in the field of an electrode or of its group.
  [[nodiscard]] std::size_t afferents(std::size_t electrode) const noexcept {
    return activity_.afferents(encoding_.of_electrode[electrode]);
  }

 private:
  /// Usually 0 to 1; may be larger or not finite.
  struct Drive {
    double amplitude = 0.0;
    double frequency = 0.0;
  };
  struct OwnDrive : Drive {
    std::chrono::nanoseconds valid_until = std::chrono::nanoseconds::min();
  };

  StimulationEncoder(const EncodingParameters& parameters, const EncodedModel& model);
  bool find_stops(const Tick& tick) noexcept;
  void find_presses(const Tick& tick) noexcept;
  void advance_histories(const Tick& tick, bool first) noexcept;
  [[nodiscard]] std::size_t collect_pulses(const Tick& tick) noexcept;
  void update(std::span<StimulationCommand> commands) noexcept;
  [[nodiscard]] Drive drive(std::size_t source) const noexcept;

  EncodingParameters parameters_;
  std::chrono::nanoseconds tick_;
  std::vector<std::size_t> patch_of_probe_;
  EncoderSources encoding_;
  FieldActivity activity_;
  FieldTouch touch_;
  GroupPulses group_pulses_;
  std::vector<OwnDrive> own_;  ///< by source
  StimulationLimiter limiter_;
  StimulatorSteps steps_;
  std::vector<Stop> stop_of_patch_;
  /// By patch: a run that starts in the middle of a press has an onset that was none. Spikes before
  /// this time do not count.
  std::vector<std::chrono::nanoseconds> settled_;
  std::vector<StimulationCommand> commands_;
  std::optional<std::chrono::nanoseconds> last_end_;  ///< of the last tick
  std::chrono::nanoseconds next_update_{0};
  std::uint32_t heartbeat_ = 0;
  std::uint64_t stops_ = 0;
  Stop latched_ = Stop::kNone;
};

}  // namespace merkel
