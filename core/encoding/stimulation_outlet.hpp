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
/// If the receiver has missed commands, because its sink was late or it was away, an off
/// (`sink_failure`) replaces the next update, and amplitudes then rise from 0 no faster than the
/// slope, up to those of the gate. Heartbeats stay those of the gate, so that a missed update
/// shows. It never increases an amplitude. Thread: one, that of the receiver's sink.
class StimulationOutlet {
 public:
  using Time = std::chrono::nanoseconds;
  /// A command that is older when it comes here is not passed on; a stop is.
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
  enum class Treatment : std::uint8_t { kPass, kRefuse, kOff };
  [[nodiscard]] Treatment treatment_of_update(const SentCommand& first, Time now) noexcept;
  void limit(StimulationCommand& command, Time now) noexcept;

  std::vector<double> max_slope_uA_per_s_;  ///< by electrode
  StimulatorSteps steps_;
  std::vector<SentCommand> leaving_;
  std::vector<SentCommand> refused_;
  Treatment update_ = Treatment::kPass;  ///< of the update whose parts arrive
  std::optional<Time> since_;            ///< the last off: amplitudes rise from 0 since then
  bool lost_ = false;                    ///< the next update is an off
};

}  // namespace merkel
