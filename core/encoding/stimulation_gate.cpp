#include "core/encoding/stimulation_gate.hpp"

#include <algorithm>
#include <cmath>

#include "core/encoding/stimulation_limiter.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;

/// Ticks by which a command may be late besides the delay and the sink's tolerance.
constexpr int kLateTicks = 2;

}  // namespace

StimulationGate::StimulationGate(const EncodingParameters& parameters, Time tick)
    : update_(parameters.stimulation.update),
      tick_(tick),
      watchdog_(parameters.stimulation.watchdog),
      steps_(parameters),
      lines_(parameters.electrodes.size()),
      group_pulse_end_(parameters.groups.size(), Time::min()) {
  for (const Electrode& each : parameters.electrodes) {
    patch_of_electrode_.push_back(each.patch);
    const ElectrodeLimits limits = ElectrodeLimits::of(each, parameters.stimulation);
    max_slope_uA_per_s_.push_back(limits.max_slope_uA_per_s);
    pulse_length_.push_back(limits.pulse);
    phase_.push_back(limits.phase);
    group_.push_back(each.group);
    // The pulses of a tick leave together, so their times are known to a tick.
    const Time interval{static_cast<std::int64_t>(std::ceil(1e9 / each.frequency_Hz[1]))};
    pulse_interval_.push_back(interval - std::min(interval, tick));
  }
  for (std::size_t g = 0; g < parameters.groups.size(); ++g) {
    Time shortest = Time::max();
    for (std::size_t e = 0; e < group_.size(); ++e) {
      if (group_[e] == g) shortest = std::min(shortest, pulse_length_[e]);
    }
    group_charge_.emplace_back(
        parameters.groups[g].max_charge_nC_per_s.value_or(StimulationLimiter::kNone), shortest);
  }
}

std::span<const SentCommand> StimulationGate::pass(std::span<const StimulationCommand> commands,
                                                   const Moment& moment) {
  leaving_.clear();
  watch(moment);
  for (const StimulationCommand& command : commands) {
    if (command.electrode >= lines_.size()) continue;
    if (command.kind == Kind::kPulse) {
      pass_pulse(command, moment);
      continue;
    }
    update_commands_.push_back(command);
    if (update_commands_.size() < lines_.size()) continue;
    pass_update(moment);
    update_commands_.clear();
  }
  return leaving_;
}

void StimulationGate::jump() noexcept {
  update_commands_.clear();
  last_time_ = Time::min();
  needs_update_ = true;
  ended_ = false;
}

/// Finds the electrodes whose commands rest on nothing new, and switches them off.
void StimulationGate::watch(const Moment& moment) {
  const bool resumes = last_call_ && moment.now - *last_call_ > watchdog_;
  const bool starves = moment.now - last_sent_ > watchdog_ + update_;
  const bool hangs = moment.now - moment.last_tick > watchdog_;
  const bool stops = moment.stops != stops_;
  last_call_ = moment.now;
  stops_ = moment.stops;
  stopped_ = moment.stopped || stops;
  if (heartbeat_ == 0 || ended_) return;
  bool starts = resumes;
  for (std::size_t e = 0; e < lines_.size(); ++e) {
    Line& line = lines_[e];
    const std::size_t patch = patch_of_electrode_[e];
    const bool silent = patch < moment.newest.size() && moment.newest[patch] != kNone &&
                        moment.now - moment.newest[patch] > watchdog_;
    const bool stale = hangs || silent;
    starts = starts || ((stale || starves) && !line.stale);
    line.stale = stale;
    if (stale) line.pulse_from = moment.now;
  }
  counts_.stale += starts ? 1 : 0;
  if (starts || stops) switch_off(moment, resumes || starves);
}

/// \param all  also the electrodes that are not stale any more
void StimulationGate::switch_off(const Moment& moment, bool all) {
  needs_update_ = true;
  off_.resize(lines_.size());
  for (std::size_t e = 0; e < lines_.size(); ++e) {
    const Line& line = lines_[e];
    off_[e] = {.time = moment.now - moment.wall_offset - moment.delay,
               .amplitude_uA = line.amplitude_uA,
               .frequency_Hz = line.frequency_Hz,
               .electrode = static_cast<std::uint16_t>(e),
               .kind = Kind::kUpdate,
               .stop = all || line.stale ? Stop::kStale : Stop::kNone};
  }
  send(off_, moment);
}

bool StimulationGate::fresh(const StimulationCommand& command,
                            const Moment& moment) const noexcept {
  const Time age = moment.now - (command.time + moment.wall_offset);
  return age <= moment.delay + kLateTicks * tick_ + kSinkTolerance && command.time >= last_time_;
}

void StimulationGate::pass_update(const Moment& moment) {
  const bool on_time = fresh(update_commands_.front(), moment);
  bool stops = false;
  for (const StimulationCommand& command : update_commands_) {
    stops = stops || command.stop != Stop::kNone;
    ended_ = ended_ || command.stop == Stop::kEnd;
  }
  if (!on_time) {
    ++counts_.withheld;
    needs_update_ = true;
    if (!stops) return;
    // A stop leaves whenever it comes; the other electrodes stay at most as they are.
    for (StimulationCommand& command : update_commands_) {
      const Line& line = lines_[command.electrode];
      command.amplitude_uA = std::min(command.amplitude_uA, line.amplitude_uA);
      command.frequency_Hz = std::min(command.frequency_Hz, line.frequency_Hz);
    }
  }
  send(update_commands_, moment);
  if (on_time) needs_update_ = false;
}

void StimulationGate::send(std::span<StimulationCommand> update, const Moment& moment) {
  if (heartbeat_++ == 0) {
    for (Line& line : lines_) line.pulse_from = moment.now;
  }
  // After a pause the amplitude rises as after one update.
  const Time elapsed = std::min(moment.now - last_sent_, update_ + kLateTicks * tick_);
  last_time_ = std::max(last_time_, update.front().time);
  for (StimulationCommand& command : update) {
    Line& line = lines_[command.electrode];
    command.time = last_time_;
    command.heartbeat = heartbeat_;
    if (line.stale && command.stop == Stop::kNone) command.stop = Stop::kStale;
    if (stopped_ && command.stop != Stop::kEnd) command.stop = Stop::kStopped;
    line.stopped = command.stop != Stop::kNone;
    if (line.stopped) {
      command.amplitude_uA = 0.0;
      line.pulse_uA = 0.0;
      line.pulse_from = moment.now;
    }
    command.amplitude_uA = risen_uA(command, line.amplitude_uA, elapsed);
    if (!(command.amplitude_uA > 0.0)) command.amplitude_uA = command.frequency_Hz = 0.0;
    line.amplitude_uA = command.amplitude_uA;
    line.frequency_Hz = command.frequency_Hz;
  }
  // The slope goes on from what was allowed, not from the step below it.
  steps_.round_down(update);
  for (const StimulationCommand& command : update) leave(command, moment);
  last_sent_ = moment.now;
}

void StimulationGate::leave(const StimulationCommand& command, const Moment& moment) {
  leaving_.push_back(
      {.command = command, .sent = moment.now, .valid_until = moment.now + watchdog_});
}

void StimulationGate::pass_pulse(StimulationCommand pulse, const Moment& moment) {
  Line& line = lines_[pulse.electrode];
  const auto group = group_[pulse.electrode];
  const bool soon = (line.pulse && moment.now - *line.pulse < pulse_interval_[pulse.electrode]) ||
                    (group && moment.now < group_pulse_end_[*group]);
  // The budget of a pulse rests on the update before it.
  if (needs_update_ || line.stopped || line.stale || soon || !fresh(pulse, moment)) {
    ++counts_.withheld;
    return;
  }
  pulse.amplitude_uA = risen_uA(pulse, line.pulse_uA, moment.now - line.pulse_from);
  if (!(pulse.amplitude_uA > 0.0)) return;
  if (group &&
      !group_charge_[*group].takes(moment.now, pulse.amplitude_uA, phase_[pulse.electrode])) {
    ++counts_.withheld;
    return;
  }
  line.pulse_uA = pulse.amplitude_uA;
  line.pulse_from = moment.now;
  line.pulse = moment.now;
  if (group) group_pulse_end_[*group] = moment.now + pulse_length_[pulse.electrode];
  pulse.heartbeat = heartbeat_;
  last_time_ = std::max(last_time_, pulse.time);
  if (steps_.round_pulses({&pulse, 1}) > 0) leave(pulse, moment);
}

double StimulationGate::risen_uA(const StimulationCommand& command, double from_uA,
                                 Time elapsed) noexcept {
  const double slope_uA_per_s = max_slope_uA_per_s_[command.electrode];
  if (std::isinf(slope_uA_per_s)) return command.amplitude_uA;
  const double highest_uA = from_uA + slope_uA_per_s * units::s_from(std::max(elapsed, Time{0}));
  if (command.amplitude_uA <= highest_uA) return command.amplitude_uA;
  ++counts_.slowed;
  return highest_uA;
}

}  // namespace merkel
