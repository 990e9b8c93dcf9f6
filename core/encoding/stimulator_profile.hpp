#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/parameters/field.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/records/stimulation_command.hpp"

namespace merkel {

struct EncodingParameters;

/// What a stimulator can do: the ranges and steps of its settings. Without a name, there is none.
struct StimulatorProfile {
  std::string name;
  double min_amplitude_uA = 0.0;
  double max_amplitude_uA = 1e5;
  double amplitude_step_uA = 0.0;  ///< 0: any value
  double min_frequency_Hz = 0.0;
  double max_frequency_Hz = 1e4;
  double frequency_step_Hz = 0.0;  ///< 0: any value
  std::chrono::nanoseconds min_phase{1'000};
  std::chrono::nanoseconds max_phase{10'000'000};
  std::chrono::nanoseconds min_interphase{0};
  std::chrono::nanoseconds max_interphase{10'000'000};
  std::chrono::nanoseconds time_step{0};  ///< of phases and of the time between them; 0: any value
  std::optional<std::int64_t> waveforms;  ///< different pulses that it holds at once; absent: any
  bool asymmetric = true;                 ///< phases of different length
  bool anodic_first = true;               ///< both polarities

  [[nodiscard]] static FieldTable fields();
  /// Fails with the first setting of a scene that the stimulator does not have. Real-time: no.
  [[nodiscard]] Expected<void, ParameterError> check(const EncodingParameters& encoding) const;
};

/// Rounds commands down to what a stimulator can do, after all limits: neither an amplitude nor a
/// frequency ever rises. Thread: one. Real-time: yes, after construction, for updates of all
/// electrodes.
class StimulatorSteps {
 public:
  /// What rounding has taken away.
  struct Counts {
    std::uint64_t rounded = 0;  ///< commands
    double largest_uA = 0.0;
    double largest_Hz = 0.0;
  };

  explicit StimulatorSteps(const EncodingParameters& encoding);

  /// Rounds, in place, commands that leave together. If they need more different waveforms than the
  /// stimulator holds, the steps double until they suffice.
  void round_down(std::span<StimulationCommand> commands) noexcept;
  /// The same for pulses; moves those that are left to the front. \return their number
  [[nodiscard]] std::size_t round_pulses(std::span<StimulationCommand> pulses) noexcept;
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  [[nodiscard]] StimulationCommand rounded(const StimulationCommand& command,
                                           double coarseness) const noexcept;
  /// Whether commands need no more waveforms than the stimulator holds.
  [[nodiscard]] bool suffice(std::span<const StimulationCommand> commands,
                             double coarseness) noexcept;

  bool active_;
  double min_uA_;
  double min_Hz_;
  double step_Hz_;
  std::optional<std::int64_t> most_waveforms_;
  std::vector<double> step_uA_;  ///< by electrode: keeps the second phase on a step too
  std::vector<std::chrono::nanoseconds> phase_;
  std::vector<StimulationCommand> seen_;  ///< one per waveform
  Counts counts_;
};

}  // namespace merkel
