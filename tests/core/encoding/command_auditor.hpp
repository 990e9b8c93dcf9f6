#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "core/encoding/stimulation_limiter.hpp"

namespace merkel {

/// Checks commands as a receiver sees them, and reports the first that exceeds a limit. It shares
/// no code with the limiter: it works on instants, not on ticks.
class CommandAuditor {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  CommandAuditor(const StimulationLimiter::Limits& limits,
                 std::vector<StimulationLimiter::OfElectrode> electrodes, Nanoseconds start)
      : limits_(limits), electrodes_(std::move(electrodes)), lines_(electrodes_.size()) {
    for (Line& line : lines_) line.level_time = line.train_time = start;
  }

  /// Takes the commands of one tick, in the order in which they are sent.
  void take(std::span<const StimulationCommand> commands) {
    Nanoseconds last = Nanoseconds::min();
    for (const StimulationCommand& command : commands) {
      if (command.time < last) fail(command, "is out of order");
      last = command.time;
      check_values(command);
      check_slope(command);
      if (command.kind == StimulationCommand::Kind::kPulse) {
        take_pulse(command);
      } else {
        take_update(command);
      }
    }
    // Check the sums at the end of the tick: all trains change at one instant.
    if (!commands.empty()) check_sums(commands);
    tick_ = std::max(tick_, last);
  }

  /// Empty, or the limit that the first bad command exceeded.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] double train_uA(std::size_t electrode) const { return lines_[electrode].train_uA; }
  [[nodiscard]] double most_total_uA() const { return most_total_uA_; }

 private:
  struct Line {
    double train_uA = 0.0;
    Nanoseconds train_time{0};
    double level_uA = 0.0;  ///< of the last pulse; 0 after a stop
    Nanoseconds level_time{0};
    std::optional<Nanoseconds> pulse;
    double pulse_uA = 0.0;
  };

  void fail(const StimulationCommand& command, const std::string& what) {
    if (!fault_.empty()) return;
    std::ostringstream text;
    text.precision(17);
    text << "electrode " << command.electrode << " at " << command.time.count() << " ns, "
         << command.amplitude_uA << " uA, " << command.frequency_Hz << " Hz: " << what;
    fault_ = text.str();
  }

  void check_values(const StimulationCommand& command) {
    const auto& limit = electrodes_[command.electrode];
    const double charge_nC = command.amplitude_uA * static_cast<double>(limit.phase.count()) * 1e-6;
    if (!std::isfinite(command.amplitude_uA) || !std::isfinite(command.frequency_Hz)) {
      fail(command, "is not finite");
    }
    if (command.amplitude_uA < 0.0 || command.frequency_Hz < 0.0) fail(command, "is negative");
    if (command.amplitude_uA > limit.max_uA) fail(command, "is above the amplitude");
    if (command.frequency_Hz > limit.max_Hz) fail(command, "is above the frequency");
    if (charge_nC > limit.max_charge_nC * (1.0 + 1e-12)) fail(command, "is above the charge");
  }

  void check_slope(const StimulationCommand& command) {
    const Line& line = lines_[command.electrode];
    const bool pulse = command.kind == StimulationCommand::Kind::kPulse;
    const double from_uA = pulse ? line.level_uA : line.train_uA;
    const auto since = command.time - (pulse ? line.level_time : line.train_time);
    const double rise_uA = command.amplitude_uA - from_uA;
    const double slope_uA_per_s = electrodes_[command.electrode].max_slope_uA_per_s;
    if (rise_uA >
        slope_uA_per_s * 1e-9 * static_cast<double>(since.count()) * (1.0 + 1e-9) + 1e-9) {
      fail(command, "rises too fast");
    }
  }

  void take_pulse(const StimulationCommand& command) {
    Line& line = lines_[command.electrode];
    if (line.pulse && static_cast<double>((command.time - *line.pulse).count()) *
                              electrodes_[command.electrode].max_Hz <
                          1e9 * (1.0 - 1e-12)) {
      fail(command, "comes too soon after the pulse before it");
    }
    check_group(command);
    line.pulse = line.level_time = command.time;
    line.pulse_uA = line.level_uA = command.amplitude_uA;
    check_instant(command);
  }

  /// Two electrodes of a group never pulse together, and their charge in any second is limited.
  void check_group(const StimulationCommand& command) {
    const auto& limit = electrodes_[command.electrode];
    if (limit.group == StimulationLimiter::kNoGroup) return;
    std::deque<StimulationCommand>& recent = recent_[limit.group];
    if (!recent.empty()) {
      const StimulationCommand& last = recent.back();
      if (command.time - last.time < electrodes_[last.electrode].pulse) {
        fail(command, "overlaps a pulse of its group");
      }
      if (last.time > tick_) fail(command, "is in the same tick as a pulse of its group");
    }
    recent.push_back(command);
    double charge_nC = 0.0;
    for (const StimulationCommand& each : recent) {
      if (command.time - each.time >= std::chrono::seconds{1}) continue;
      charge_nC +=
          each.amplitude_uA * static_cast<double>(electrodes_[each.electrode].phase.count()) * 1e-6;
    }
    if (charge_nC > limits_.groups[limit.group].max_charge_nC_per_s * (1.0 + 1e-9)) {
      fail(command, "is above the charge of its group");
    }
  }

  void take_update(const StimulationCommand& command) {
    Line& line = lines_[command.electrode];
    line.train_uA = command.amplitude_uA;
    line.train_time = command.time;
    if (command.stop == StimulationCommand::Stop::kNone) return;
    if (command.amplitude_uA != 0.0) fail(command, "is on although it is stopped");
    line.level_uA = 0.0;
    line.level_time = command.time;
  }

  /// Checks all currents at the instant of a command.
  void check_instant(const StimulationCommand& command) {
    double total_uA = 0.0;
    std::size_t active = 0;
    for (std::size_t e = 0; e < lines_.size(); ++e) {
      const Line& line = lines_[e];
      const bool pulsing = line.pulse && *line.pulse + electrodes_[e].pulse > command.time;
      const double flows_uA = line.train_uA + (pulsing ? line.pulse_uA : 0.0);
      total_uA += flows_uA;
      if (flows_uA > 0.0) ++active;
    }
    most_total_uA_ = std::max(most_total_uA_, total_uA);
    if (total_uA > limits_.max_total_uA) fail(command, "brings the total above the budget");
    if (active > limits_.max_electrodes) fail(command, "is one electrode too many");
  }

  /// A receiver may apply the pulses of a tick together, so they count as simultaneous.
  void check_sums(std::span<const StimulationCommand> commands) {
    check_instant(commands.back());
    std::map<std::size_t, double> of_tick;
    for (const StimulationCommand& command : commands) {
      if (command.kind != StimulationCommand::Kind::kPulse) continue;
      double& strongest = of_tick[command.electrode];
      strongest = std::max(strongest, command.amplitude_uA);
    }
    double pulses_uA = 0.0;
    for (const auto& [electrode, amplitude_uA] : of_tick) pulses_uA += amplitude_uA;
    double trains_uA = 0.0;
    for (const double train_uA : trains_before_) trains_uA += train_uA;
    if (pulses_uA > 0.0 && pulses_uA + trains_uA > limits_.max_total_uA) {
      fail(commands.back(), "ends a tick whose pulses are above the budget together");
    }
    trains_before_.clear();
    for (const Line& line : lines_) trains_before_.push_back(line.train_uA);
  }

  StimulationLimiter::Limits limits_;
  std::vector<StimulationLimiter::OfElectrode> electrodes_;
  std::vector<Line> lines_;
  std::map<std::size_t, std::deque<StimulationCommand>> recent_;  ///< pulses, by group
  Nanoseconds tick_ = Nanoseconds::min();  ///< of the last command of earlier ticks
  std::vector<double> trains_before_;      ///< during the current tick
  double most_total_uA_ = 0.0;
  std::string fault_;
};

}  // namespace merkel
