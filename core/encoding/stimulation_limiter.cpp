#include "core/encoding/stimulation_limiter.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/encoding/encoding_parameters.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// Totals are scaled to slightly below the budget, so that rounding cannot raise the sum above it.
constexpr double kBelow = 1.0 - 0x1.0p-40;
/// Share of the budget below which pulses are dropped.
constexpr double kMinShare = 1e-6;

double largest_within_charge(double max_charge_nC, nanoseconds phase) {
  double amplitude_uA = max_charge_nC * 1e3 / units::us_from(phase);
  while (charge_nC(amplitude_uA, phase) > max_charge_nC) {
    amplitude_uA = std::nextafter(amplitude_uA, 0.0);
  }
  return amplitude_uA;
}

}  // namespace

StimulationLimiter::StimulationLimiter(const Limits& limits, std::vector<OfElectrode> electrodes)
    : limits_(limits),
      electrodes_(std::move(electrodes)),
      budget_uA_(kBelow * limits.max_total_uA),
      outputs_(electrodes_.size()),
      order_(electrodes_.size()) {
  for (const OfGroup& group : limits_.groups) {
    recent_.push_back({.charge = {group.max_charge_nC_per_s, group.gap}, .pulse = {}});
  }
  for (const OfElectrode& each : electrodes_) {
    charge_uA_.push_back(largest_within_charge(each.max_charge_nC, each.phase));
    interval_.emplace_back(static_cast<std::int64_t>(std::ceil(1e9 / each.max_Hz)));
  }
}

void StimulationLimiter::reset(nanoseconds time) noexcept {
  std::fill(outputs_.begin(), outputs_.end(), Output{.rise_time = time});
  for (Recent& recent : recent_) {
    recent.charge.reset();
    recent.pulse.reset();
  }
  last_update_ = time;
}

bool StimulationLimiter::group_takes(const StimulationCommand& pulse) noexcept {
  const OfElectrode& electrode = electrodes_[pulse.electrode];
  if (electrode.group == kNoGroup) return true;
  Recent& recent = recent_[electrode.group];
  const bool close =
      recent.pulse && pulse.time - *recent.pulse < limits_.groups[electrode.group].gap;
  if (close || !recent.charge.takes(pulse.time, pulse.amplitude_uA, electrode.phase)) {
    ++clippings_.group;
    return false;
  }
  recent.pulse = pulse.time;
  return true;
}

void StimulationLimiter::limit_command(StimulationCommand& command) noexcept {
  const OfElectrode& limit = electrodes_[command.electrode];
  double& amplitude_uA = command.amplitude_uA;
  if (!(std::isfinite(amplitude_uA) && amplitude_uA >= 0.0 && std::isfinite(command.frequency_Hz) &&
        command.frequency_Hz >= 0.0)) {
    amplitude_uA = command.frequency_Hz = 0.0;
    ++clippings_.invalid;
  }
  if (amplitude_uA > limit.max_uA) {
    amplitude_uA = limit.max_uA;
    ++clippings_.amplitude;
  }
  if (amplitude_uA > charge_uA_[command.electrode]) {
    amplitude_uA = charge_uA_[command.electrode];
    ++clippings_.charge;
  }
  if (command.frequency_Hz > limit.max_Hz) {
    command.frequency_Hz = limit.max_Hz;
    ++clippings_.frequency;
  }
}

void StimulationLimiter::limit_rise(StimulationCommand& command, double from_uA,
                                    nanoseconds elapsed) noexcept {
  const double slope_uA_per_s = electrodes_[command.electrode].max_slope_uA_per_s;
  if (slope_uA_per_s == kNone) return;
  const double highest_uA = from_uA + slope_uA_per_s * units::s_from(elapsed);
  if (command.amplitude_uA <= highest_uA) return;
  command.amplitude_uA = highest_uA;
  ++clippings_.slope;
}

bool StimulationLimiter::alive(std::size_t electrode, nanoseconds time) const noexcept {
  const Output& output = outputs_[electrode];
  return output.pulse_uA > 0.0 && output.pulse_time + electrodes_[electrode].pulse > time;
}

void StimulationLimiter::keep_strongest(std::span<StimulationCommand> update,
                                        std::size_t allowed) noexcept {
  const auto active = [&](std::size_t i) { return update[i].amplitude_uA > 0.0; };
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  const auto last = std::partition(order_.begin(), order_.end(), active);
  if (static_cast<std::size_t>(last - order_.begin()) <= allowed) return;
  const auto kept = order_.begin() + static_cast<std::ptrdiff_t>(allowed);
  std::nth_element(order_.begin(), kept, last, [&](std::size_t a, std::size_t b) {
    return std::pair(-update[a].amplitude_uA, a) < std::pair(-update[b].amplitude_uA, b);
  });
  for (auto each = kept; each != last; ++each) {
    update[*each].amplitude_uA = update[*each].frequency_Hz = 0.0;
    ++clippings_.electrodes;
  }
}

void StimulationLimiter::scale_update(std::span<StimulationCommand> update,
                                      double alive_uA) noexcept {
  double trains_uA = 0.0;
  double pulses_uA = 0.0;
  for (Recent& recent : recent_) recent.wanted_uA = 0.0;
  for (std::size_t i = 0; i < update.size(); ++i) {
    trains_uA += update[i].amplitude_uA;
    if (electrodes_[i].group == kNoGroup) {
      pulses_uA += outputs_[i].wanted_uA;
    } else {
      double& wanted_uA = recent_[electrodes_[i].group].wanted_uA;
      wanted_uA = std::max(wanted_uA, outputs_[i].wanted_uA);
    }
  }
  for (const Recent& recent : recent_) pulses_uA += recent.wanted_uA;
  // Trains share the budget with the expected pulses and leave room for the pulses in progress.
  if (trains_uA + pulses_uA <= limits_.max_total_uA &&
      trains_uA + alive_uA <= limits_.max_total_uA) {
    return;
  }
  if (!(trains_uA > 0.0)) return;
  const double factor = std::min(budget_uA_ / (trains_uA + pulses_uA),
                                 std::max(0.0, budget_uA_ - alive_uA) / trains_uA);
  for (StimulationCommand& command : update) command.amplitude_uA *= factor;
  ++clippings_.total;
}

void StimulationLimiter::limit_update(std::span<StimulationCommand> update) noexcept {
  const nanoseconds time = update.front().time;
  std::size_t pulsing = 0;
  double alive_uA = 0.0;
  for (std::size_t i = 0; i < update.size(); ++i) {
    limit_command(update[i]);
    limit_rise(update[i], outputs_[i].train_uA, time - last_update_);
    if (!alive(i, time)) continue;
    ++pulsing;
    alive_uA += outputs_[i].pulse_uA;
  }
  keep_strongest(update, limits_.max_electrodes - std::min(pulsing, limits_.max_electrodes));
  scale_update(update, alive_uA);
  for (std::size_t i = 0; i < update.size(); ++i) {
    if (!(update[i].amplitude_uA > 0.0)) update[i].frequency_Hz = 0.0;
    outputs_[i].train_uA = update[i].amplitude_uA;
    outputs_[i].wanted_uA = 0.0;
    if (update[i].stop == StimulationCommand::Stop::kNone) continue;
    outputs_[i].rise_from_uA = 0.0;
    outputs_[i].rise_time = time;
  }
  last_update_ = time;
}

std::size_t StimulationLimiter::limit_pulses(std::span<StimulationCommand> pulses,
                                             nanoseconds tick_begin) noexcept {
  std::size_t active = 0;
  double used_uA = 0.0;
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    Output& output = outputs_[i];
    const bool under_way = alive(i, tick_begin);
    used_uA += output.train_uA + (under_way ? output.pulse_uA : 0.0);
    if (output.train_uA > 0.0 || under_way) ++active;
    output.tick_uA = 0.0;
  }
  std::size_t kept = 0;
  for (StimulationCommand pulse : pulses) {
    Output& output = outputs_[pulse.electrode];
    if (output.pulsed && pulse.time - output.pulse_time < interval_[pulse.electrode]) {
      ++clippings_.frequency;
      continue;
    }
    limit_command(pulse);
    limit_rise(pulse, output.rise_from_uA, pulse.time - output.rise_time);
    if (!(pulse.amplitude_uA > 0.0)) continue;
    const bool counted = alive(pulse.electrode, tick_begin);
    if (!counted && active >= limits_.max_electrodes) {
      ++clippings_.electrodes;
      continue;
    }
    if (!group_takes(pulse)) continue;
    if (!counted) ++active;
    output.tick_uA = std::max(output.tick_uA, pulse.amplitude_uA);
    output.pulse_uA = output.rise_from_uA = pulse.amplitude_uA;
    output.pulse_time = output.rise_time = pulse.time;
    output.pulsed = true;
    pulses[kept++] = pulse;
  }
  return scale_pulses(pulses.first(kept), used_uA);
}

std::size_t StimulationLimiter::scale_pulses(std::span<StimulationCommand> pulses,
                                             double used_uA) noexcept {
  double pulses_uA = 0.0;
  for (Output& output : outputs_) {
    pulses_uA += output.tick_uA;
    output.wanted_uA = std::max(output.wanted_uA, output.tick_uA);
  }
  if (used_uA + pulses_uA <= limits_.max_total_uA) return pulses.size();
  ++clippings_.total;
  const double left_uA = budget_uA_ - used_uA;
  const bool none = left_uA < kMinShare * limits_.max_total_uA;
  const double factor = none ? 0.0 : left_uA / pulses_uA;
  for (StimulationCommand& pulse : pulses) {
    pulse.amplitude_uA *= factor;
    outputs_[pulse.electrode].pulse_uA = pulse.amplitude_uA;
    outputs_[pulse.electrode].rise_from_uA = pulse.amplitude_uA;
  }
  return none ? 0 : pulses.size();
}

}  // namespace merkel
