#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/charge_window.hpp"
#include "core/encoding/encoding_parameters.hpp"
#include "core/records/sent_command.hpp"

namespace merkel {

/// The last stage before a receiver: makes the commands of an encoder safe in wall time.
///
/// The encoder works in probe time, so that its commands can be replayed. The gate knows when they
/// leave. Commands that are older than the delay of the run and its tolerance are withheld, so that
/// no backlog reaches a receiver. An amplitude rises no faster than the slope between the instants
/// at which updates leave. If the simulation or the samples stop for longer than the watchdog, the
/// gate switches electrodes off by itself (`stale`), and also while stimulation is stopped by hand
/// (`stopped`). The charge of a group in any second is counted here too, where a recording that is
/// played again does not forget it. Updates that leave are numbered without gaps.
///
/// The gate never increases an amplitude. Construct with the limits of the scene. A run has one
/// gate, so that all its receivers get the same (StimulationOutlet). Thread: one.
class StimulationGate {
 public:
  using Time = std::chrono::nanoseconds;

  /// The state of the run when commands leave. Times are host-monotonic.
  struct Moment {
    Time now{0};
    Time wall_offset{0};             ///< wall time − probe time
    Time delay{0};                   ///< of the loop
    Time last_tick{0};               ///< when the loop last published a tick
    std::span<const Time> newest{};  ///< time of each patch's oldest newest sample; see kNone
    bool stopped = false;            ///< by hand: everything is off, at once
    std::uint16_t stops = 0;         ///< by hand, so far: also one that is over switches off
  };
  /// For a patch without a device: its samples are never stale.
  static constexpr Time kNone = Time::max();
  /// How long a sink may take to pass on a command.
  static constexpr Time kSinkTolerance{5'000'000};

  struct Counts {
    std::uint64_t withheld = 0;  ///< updates and pulses that came too late to leave
    std::uint64_t slowed = 0;    ///< amplitudes reduced to the slope in wall time
    std::uint64_t stale = 0;     ///< times that the watchdog switched electrodes off
  };

  StimulationGate(const EncodingParameters& parameters, Time tick);

  /// Passes on commands of the encoder. Call it at least every few milliseconds, with no commands
  /// if there are none, because it is also the watchdog.
  /// \param commands  in order; an update may arrive in several parts
  /// \return the commands that leave now, valid until the next call.  Real-time: no.
  std::span<const SentCommand> pass(std::span<const StimulationCommand> commands,
                                    const Moment& moment);

  /// Time jumps, as when a recording is played from elsewhere: earlier commands may follow. Switch
  /// the electrodes off before.
  void jump() noexcept;

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  /// What the receiver of an electrode applies.
  struct Line {
    double amplitude_uA = 0.0;  ///< of the last update
    double frequency_Hz = 0.0;
    double pulse_uA = 0.0;  ///< of the last pulse; 0 after a stop
    Time pulse_from{0};     ///< wall time of that pulse or stop
    std::optional<Time> pulse;
    bool stopped = true;  ///< by the last update: no pulse may leave before another
    bool stale = false;
  };

  void watch(const Moment& moment);
  void switch_off(const Moment& moment, bool all);
  void pass_update(const Moment& moment);
  void pass_pulse(StimulationCommand pulse, const Moment& moment);
  void send(std::span<StimulationCommand> update, const Moment& moment);
  void leave(const StimulationCommand& command, const Moment& moment);
  [[nodiscard]] bool fresh(const StimulationCommand& command, const Moment& moment) const noexcept;
  /// The command's amplitude, within the slope of its electrode.
  [[nodiscard]] double risen_uA(const StimulationCommand& command, double from_uA,
                                Time elapsed) noexcept;

  std::vector<std::size_t> patch_of_electrode_;
  std::vector<Time> pulse_interval_;               ///< smallest in wall time, by electrode
  std::vector<double> max_slope_uA_per_s_;         ///< by electrode
  std::vector<std::optional<std::size_t>> group_;  ///< by electrode
  std::vector<Time> pulse_length_;                 ///< by electrode
  std::vector<Time> phase_;                        ///< by electrode
  Time update_;
  Time tick_;
  Time watchdog_;
  StimulatorSteps steps_;  ///< of what the slope in wall time has changed
  std::vector<Line> lines_;
  /// By group: of its last pulse, at a receiver that gives it on arrival.
  std::vector<Time> group_pulse_end_;
  std::vector<ChargeWindow> group_charge_;           ///< of what left, in wall time
  std::vector<StimulationCommand> update_commands_;  ///< the parts of an update so far
  std::vector<StimulationCommand> off_;
  std::vector<SentCommand> leaving_;
  std::optional<Time> last_call_;
  Time last_sent_{0};             ///< wall time of the last update
  Time last_time_ = Time::min();  ///< probe time of the last command that left
  std::uint32_t heartbeat_ = 0;   ///< 0: nothing has left
  bool needs_update_ = true;      ///< before a pulse may leave
  bool ended_ = false;
  bool stopped_ = false;     ///< by hand
  std::uint16_t stops_ = 0;  ///< by hand
  Counts counts_;
};

}  // namespace merkel
