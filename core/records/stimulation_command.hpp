#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace merkel {

/// One stimulation command for one electrode: plain data that crosses threads.
///
/// Updates cover all electrodes at once and share a heartbeat number, which increases by one per
/// update, so a receiver can detect a lost update and stop by itself. An electrode keeps the
/// amplitude and frequency of its last update until the next one. A pulse is one biphasic pulse at
/// its own time.
struct StimulationCommand {
  enum class Kind : std::uint8_t { kUpdate, kPulse };
  /// The reason for an amplitude of 0, regardless of the encoder.
  enum class Stop : std::uint8_t {
    kNone,
    kReleased,       ///< a probe on the electrode's patch was silent for too long, or has ended
    kGap,            ///< the simulation skipped ticks
    kNeuronReset,    ///< a neuron of the patch was reset after a non-finite state
    kSinkFailure,    ///< a receiver of the commands failed; holds until the end of the run
    kEnd,            ///< the run is over
    kStale,          ///< the simulation or a probe's samples stopped, measured in wall time
    kStopped,        ///< stopped by hand; holds until stimulation is started again
    kZeroUncertain,  ///< suspended: ProbeSample::kZeroUncertain
    kOutsideCalibration,  ///< suspended: ProbeSample::kOutsideCalibration
    kNoDrive,             ///< the encoder is `own`, and gave no drive within the watchdog
    kLast = kNoDrive,
  };

  std::chrono::nanoseconds time{0};  ///< probe time: a tick's end; for a pulse, its spike's time
  double amplitude_uA = 0.0;         ///< of one phase; 0: off
  double frequency_Hz = 0.0;         ///< of the pulse train; 0 for a single pulse
  std::uint32_t heartbeat = 0;  ///< number of the update, from 1; of the last update for a pulse
  std::uint16_t electrode = 0;  ///< from 0, in the order of the scene
  Kind kind = Kind::kUpdate;
  Stop stop = Stop::kNone;

  friend bool operator==(const StimulationCommand&, const StimulationCommand&) = default;
};

static_assert(std::is_trivially_copyable_v<StimulationCommand>);
static_assert(sizeof(StimulationCommand) == 32);

/// "update", "pulse".
[[nodiscard]] constexpr std::string_view name_of(StimulationCommand::Kind kind) noexcept {
  return kind == StimulationCommand::Kind::kPulse ? "pulse" : "update";
}

/// "", "released", "gap", "neuron_reset", "sink_failure", "end", "stale", "stopped",
/// "zero_uncertain", "outside_calibration", "no_drive".
[[nodiscard]] constexpr std::string_view name_of(StimulationCommand::Stop stop) noexcept {
  switch (stop) {
    case StimulationCommand::Stop::kNone:
      return "";
    case StimulationCommand::Stop::kReleased:
      return "released";
    case StimulationCommand::Stop::kGap:
      return "gap";
    case StimulationCommand::Stop::kNeuronReset:
      return "neuron_reset";
    case StimulationCommand::Stop::kSinkFailure:
      return "sink_failure";
    case StimulationCommand::Stop::kEnd:
      return "end";
    case StimulationCommand::Stop::kStale:
      return "stale";
    case StimulationCommand::Stop::kStopped:
      return "stopped";
    case StimulationCommand::Stop::kZeroUncertain:
      return "zero_uncertain";
    case StimulationCommand::Stop::kOutsideCalibration:
      return "outside_calibration";
    case StimulationCommand::Stop::kNoDrive:
      return "no_drive";
  }
  return "";
}

}  // namespace merkel
