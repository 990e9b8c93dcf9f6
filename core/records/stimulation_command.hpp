#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace merkel {

/// One stimulation command for one electrode: plain data that crosses threads.
///
/// Updates come for every electrode at once and share a heartbeat number, which rises by one from
/// update to update: a receiver that misses it can stop by itself. An electrode keeps the amplitude
/// and the frequency of its last update until the next one. A pulse is one biphasic pulse at its
/// own time.
struct StimulationCommand {
  enum class Kind : std::uint8_t { kUpdate, kPulse };
  /// Why the amplitude was set to 0, whatever the encoder returned.
  enum class Stop : std::uint8_t {
    kNone,
    kReleased,     ///< a probe on the electrode's patch has sent nothing for too long, or has ended
    kGap,          ///< the simulation left ticks out
    kNeuronReset,  ///< a neuron of the patch was reset: its state had turned non-finite
    kSinkFailure,  ///< a receiver of the commands failed; holds to the end of the run
    kEnd,          ///< the run is over
  };

  std::chrono::nanoseconds time{0};  ///< probe time: a tick's end; of a pulse, its spike's
  double amplitude_uA = 0.0;         ///< of a phase; 0 is off
  double frequency_Hz = 0.0;         ///< of the pulse train; 0 of a single pulse
  std::uint32_t heartbeat = 0;       ///< number of the update, from 1; a pulse has the last one's
  std::uint16_t electrode = 0;       ///< from 0, in the order of the scene
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

/// "", "released", "gap", "neuron_reset", "sink_failure", "end".
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
  }
  return "";
}

}  // namespace merkel
