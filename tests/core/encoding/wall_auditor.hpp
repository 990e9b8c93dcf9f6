#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "core/records/stimulation_command.hpp"

namespace merkel {

/// Checks the stream that a receiver gets, with the time at which each command arrived. It shares
/// no code with the encoder, the limiter and the gate.
class WallAuditor {
 public:
  using Time = std::chrono::nanoseconds;

  struct Promises {
    std::size_t electrodes = 0;
    double max_slope_uA_per_s = 0.0;
    Time update{0};
    Time watchdog{0};
    Time tick{0};
    Time sink{0};  ///< how long the sink may take
    std::vector<Time> pulse_interval;
  };

  explicit WallAuditor(Promises promises)
      : promises_(std::move(promises)), lines_(promises_.electrodes) {}

  /// \param delay  of the loop when the commands left
  void take(Time wall, Time delay, std::span<const StimulationCommand> commands) {
    for (const StimulationCommand& command : commands) {
      if (command.kind == StimulationCommand::Kind::kPulse) {
        take_pulse(wall, delay, command);
      } else {
        take_update(wall, delay, command);
      }
      last_time_ = command.time;
    }
  }

  [[nodiscard]] bool all_off() const {
    return std::all_of(lines_.begin(), lines_.end(),
                       [](const Line& line) { return line.amplitude_uA == 0.0; });
  }
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] std::uint32_t updates() const { return heartbeat_; }
  [[nodiscard]] double most_uA() const { return most_uA_; }

 private:
  struct Line {
    double amplitude_uA = 0.0;
    Time wall{0};
    bool stopped = true;
    double pulse_uA = 0.0;
    Time pulse_from{0};
    std::optional<Time> pulse;
  };

  void fail(Time wall, const StimulationCommand& command, const std::string& what) {
    if (!fault_.empty()) return;
    std::ostringstream text;
    text << "at " << wall.count() << " ns, electrode " << command.electrode << " of "
         << command.time.count() << " ns, " << command.amplitude_uA << " uA, "
         << name_of(command.stop) << ": " << what;
    fault_ = text.str();
  }

  void check_age(Time wall, Time delay, const StimulationCommand& command) {
    if (wall - command.time > delay + 2 * promises_.tick + promises_.sink) {
      fail(wall, command, "is too old");
    }
  }

  [[nodiscard]] double most_rise_uA(Time elapsed) const {
    return promises_.max_slope_uA_per_s * 1e-9 * static_cast<double>(elapsed.count()) + 1e-9;
  }

  void take_update(Time wall, Time delay, const StimulationCommand& command) {
    if (command.electrode == 0) begin_update(wall, command);
    if (command.heartbeat != heartbeat_) fail(wall, command, "has another heartbeat");
    if (command.time < last_time_) fail(wall, command, "is out of order");
    Line& line = lines_[command.electrode];
    most_uA_ = std::max(most_uA_, command.amplitude_uA);
    if (after_gap_ && command.amplitude_uA > 0.0) fail(wall, command, "is on after a silence");
    const Time elapsed = wall - line.wall;
    const Time counted =
        line.stopped ? std::min(elapsed, promises_.update + 2 * promises_.tick) : elapsed;
    if (command.amplitude_uA > line.amplitude_uA + most_rise_uA(counted)) {
      fail(wall, command, "rises too fast in wall time");
    }
    if (command.amplitude_uA > line.amplitude_uA) check_age(wall, delay, command);
    line.amplitude_uA = command.amplitude_uA;
    line.wall = wall;
    line.stopped = command.stop != StimulationCommand::Stop::kNone;
    if (!line.stopped) return;
    if (command.amplitude_uA != 0.0) fail(wall, command, "is on although it is stopped");
    line.pulse_uA = 0.0;
    line.pulse_from = wall;
  }

  void begin_update(Time wall, const StimulationCommand& command) {
    ++heartbeat_;
    after_gap_ = heartbeat_ > 1 && !all_off() &&
                 wall - last_update_ > promises_.watchdog + promises_.update + promises_.sink;
    if (command.heartbeat != heartbeat_) fail(wall, command, "misses a heartbeat");
    last_update_ = wall;
  }

  void take_pulse(Time wall, Time delay, const StimulationCommand& command) {
    check_age(wall, delay, command);
    Line& line = lines_[command.electrode];
    most_uA_ = std::max(most_uA_, command.amplitude_uA);
    if (line.stopped) fail(wall, command, "is a pulse of a stopped electrode");
    if (line.pulse &&
        wall - *line.pulse + promises_.tick < promises_.pulse_interval[command.electrode]) {
      fail(wall, command, "comes too soon in wall time");
    }
    if (command.amplitude_uA > line.pulse_uA + most_rise_uA(wall - line.pulse_from)) {
      fail(wall, command, "is a pulse that rises too fast in wall time");
    }
    line.pulse = line.pulse_from = wall;
    line.pulse_uA = command.amplitude_uA;
  }

  Promises promises_;
  std::vector<Line> lines_;
  std::uint32_t heartbeat_ = 0;
  Time last_update_{0};
  Time last_time_ = Time::min();
  bool after_gap_ = false;
  double most_uA_ = 0.0;
  std::string fault_;
};

}  // namespace merkel
