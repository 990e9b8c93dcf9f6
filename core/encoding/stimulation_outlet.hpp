#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/records/sent_command.hpp"

namespace merkel {

/// The commands of the gate for one receiver. Usually it passes on what the gate sent, unchanged.
///
/// If its sink was late, so that the receiver has missed commands, amplitudes rise from those that
/// it has no faster than the slope, up to those of the gate. If it was away, or has missed so many
/// that it has switched off by itself (SentCommand::valid_until), an off (`sink_failure`) replaces
/// the next update, and amplitudes rise from 0. A late update that stops any electrode is an off
/// for all. Updates are passed on whole. Heartbeats stay those of the gate, so that a missed update
/// shows. It never increases an amplitude. Thread: one, that of the receiver's sink.
class StimulationOutlet {
 public:
  using Time = std::chrono::nanoseconds;
  /// A command that is older when it comes here is not passed on; an update with a stop is.
  static constexpr Time kPatience{5'000'000};

  explicit StimulationOutlet(const EncodingParameters& parameters);

  /// The receiver is away, or may have lost commands.
  void lose() noexcept { lost_ = true; }
  /// \param sent  by the gate, in order; an update may arrive in several parts
  /// \param now   host-monotonic
  /// \return what is passed on, valid until the next call.  Real-time: no.
  std::span<const SentCommand> pass(std::span<const SentCommand> sent, Time now);
  /// The commands of the last call that were not passed on.
  [[nodiscard]] std::span<const SentCommand> refused() const noexcept { return refused_; }

 private:
  void pass_update(Time now);
  void pass_pulse(const SentCommand& pulse, Time now);
  void limit(StimulationCommand& command, Time now) noexcept;

  std::vector<double> max_slope_uA_per_s_;  ///< by electrode
  StimulatorSteps steps_;
  std::vector<SentCommand> leaving_;
  std::vector<SentCommand> refused_;
  std::vector<SentCommand> update_;  ///< its parts so far
  std::vector<double> last_uA_;      ///< of the last update passed on, by electrode
  Time last_{0};                     ///< when
  Time valid_until_{0};              ///< of that update
  std::vector<double> base_uA_;      ///< from which amplitudes rise, by electrode
  std::optional<Time> since_;        ///< since then; none: nothing was missed
  bool missed_ = false;              ///< since the last update
  bool lost_ = false;                ///< the next update is an off
};

}  // namespace merkel
