#include "core/encoding/stimulation_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using State = TickRecord::State;

/// Smaller drives count as off, because an exponential window never decays to 0.
constexpr double kLeastDrive = 0.01;

bool counts_spikes(EncoderKind kind) {
  return kind == EncoderKind::kRate || kind == EncoderKind::kRecruited ||
         kind == EncoderKind::kPulsePerSpike;
}

std::vector<StimulationLimiter::OfElectrode> limits_of_electrodes(
    const EncodingParameters& parameters) {
  std::vector<StimulationLimiter::OfElectrode> all;
  for (const Electrode& each : parameters.electrodes) {
    const ElectrodeLimits limits = ElectrodeLimits::of(each, parameters.stimulation);
    all.push_back({.max_uA = each.amplitude_uA[1],
                   .max_Hz = each.frequency_Hz[1],
                   .phase = limits.phase,
                   .max_charge_nC = limits.max_charge_nC,
                   .max_slope_uA_per_s = limits.max_slope_uA_per_s});
  }
  return all;
}

StimulationLimiter::Limits limits_of(const StimulationParameters& p) {
  StimulationLimiter::Limits limits{.max_total_uA = p.max_total_uA};
  if (p.max_electrodes) limits.max_electrodes = static_cast<std::size_t>(*p.max_electrodes);
  return limits;
}

/// Largest number of pulses in a tick before the limiter.
std::size_t most_pulses(const EncodingParameters& parameters, const EncodedModel& model,
                        const FieldActivity& activity) {
  std::size_t most = 0;
  for (std::size_t e = 0; e < parameters.electrodes.size(); ++e) {
    if (parameters.electrodes[e].encoder == EncoderKind::kPulsePerSpike) {
      most += activity.afferents(e) * model.most_spikes;
    }
  }
  return most;
}

Expected<void, ParameterError> check_with_model(const EncodingParameters& parameters,
                                                const EncodedModel& model) {
  ParameterCheck check;
  const nanoseconds update = parameters.stimulation.update;
  const auto nearest = std::max<std::int64_t>(1, (update + model.tick / 2) / model.tick);
  check.require(update % model.tick == nanoseconds{0}, "stimulation.update_ms",
                "must be a multiple of the tick, " + shortest_decimal(units::ms_from(model.tick)) +
                    " ms (loop.tick_us): the nearest is " +
                    shortest_decimal(units::ms_from(nearest * model.tick)));
  check.require(parameters.stimulation.watchdog >= 2 * model.tick, "stimulation.watchdog_ms",
                "must be at least two ticks of " + shortest_decimal(units::ms_from(model.tick)) +
                    " ms (loop.tick_us), for example watchdog_ms = 100");
  for (const Electrode& each : parameters.electrodes) {
    const bool known = each.patch < model.patches.size();
    check.require(known, each.key("patch"), "is not a patch of the scene");
    check.require(
        known && model.patches[each.patch].area.contains(each.field_mm[0], each.field_mm[1]),
        each.key("field_mm"), "has its centre outside the patch");
  }
  return check.result();
}

Expected<void, ParameterError> check_fields(const EncodingParameters& parameters,
                                            const FieldActivity& activity) {
  ParameterCheck check;
  for (std::size_t e = 0; e < parameters.electrodes.size(); ++e) {
    const Electrode& each = parameters.electrodes[e];
    check.require(!counts_spikes(each.encoder) || activity.afferents(e) > 0, each.key("field_mm"),
                  "contains no afferent: move it or enlarge its radius (merkel inspect "
                  "afferents prints their positions)");
  }
  return check.result();
}

}  // namespace

Expected<StimulationEncoder, ParameterError> StimulationEncoder::create(
    const EncodingParameters& parameters, const EncodedModel& model) {
  if (const auto checked = parameters.check(); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  if (const auto checked = check_with_model(parameters, model); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  StimulationEncoder encoder(parameters, model);
  if (const auto checked = check_fields(parameters, encoder.activity_); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  return encoder;
}

StimulationEncoder::StimulationEncoder(const EncodingParameters& parameters,
                                       const EncodedModel& model)
    : parameters_(parameters),
      tick_(model.tick),
      patch_of_probe_(model.patch_of_probe),
      activity_(parameters.electrodes, model),
      limiter_(limits_of(parameters.stimulation), limits_of_electrodes(parameters)),
      depths_(parameters.electrodes.size(), DepthHistory(model.tick)),
      force_N_(parameters.electrodes.size()),
      stop_of_patch_(model.patches.size()),
      commands_(parameters.electrodes.size() + most_pulses(parameters, model, activity_)) {}

void StimulationEncoder::reset() noexcept {
  activity_.reset();
  for (DepthHistory& depth : depths_) depth.reset(0.0);
  std::fill(stop_of_patch_.begin(), stop_of_patch_.end(), Stop::kNone);
  last_end_.reset();
  heartbeat_ = 0;
  stops_ = 0;
  latched_ = Stop::kNone;
}

std::span<const StimulationCommand> StimulationEncoder::step(const Tick& tick) noexcept {
  const nanoseconds end = tick.records.front().time;
  const bool first = !last_end_;
  if (first) {
    limiter_.reset(end - tick_);
    next_update_ = end;
  }
  const bool stopped = find_stops(tick);
  if (stopped) ++stops_;
  last_end_ = end;
  activity_.advance(tick.spikes, end);
  advance_histories(tick);
  const std::size_t pulses =
      limiter_.limit_pulses(std::span(commands_).first(collect_pulses(tick)), end - tick_);
  if (end < next_update_ && !stopped) return std::span(commands_).first(pulses);
  if (end >= next_update_) {
    const nanoseconds period = parameters_.stimulation.update;
    next_update_ += ((end - next_update_) / period + 1) * period;
  }
  const std::size_t electrodes = parameters_.electrodes.size();
  update(std::span(commands_).subspan(pulses, electrodes));
  return std::span(commands_).first(pulses + electrodes);
}

std::span<const StimulationCommand> StimulationEncoder::finish() noexcept {
  if (!last_end_) return {};
  std::fill(stop_of_patch_.begin(), stop_of_patch_.end(), Stop::kEnd);
  const auto commands = std::span(commands_).first(parameters_.electrodes.size());
  update(commands);
  return commands;
}

/// Finds the stop of each patch in this tick.
/// \return whether a stop has started
bool StimulationEncoder::find_stops(const Tick& tick) noexcept {
  const nanoseconds begin = tick.records.front().time - tick_;
  const bool gap = last_end_ && *last_end_ != begin;
  bool started = false;
  for (std::size_t patch = 0; patch < stop_of_patch_.size(); ++patch) {
    Stop stop = Stop::kNone;
    for (const TickRecord& record : tick.records) {
      const bool silent = record.state == State::kReleased || record.state == State::kEnded;
      if (silent && patch_of_probe_[record.probe] == patch) stop = Stop::kReleased;
    }
    for (const SpikeEvent& reset : tick.resets) {
      if (reset.patch == patch) stop = Stop::kNeuronReset;
    }
    if (gap) stop = Stop::kGap;
    if (latched_ != Stop::kNone) stop = latched_;
    started = started || (stop != Stop::kNone && stop != stop_of_patch_[patch]);
    stop_of_patch_[patch] = stop;
  }
  return started;
}

void StimulationEncoder::advance_histories(const Tick& tick) noexcept {
  for (std::size_t e = 0; e < depths_.size(); ++e) {
    const Electrode& electrode = parameters_.electrodes[e];
    const bool stopped = stop_of_patch_[electrode.patch] != Stop::kNone;
    if (stopped) activity_.reset(e);
    if (counts_spikes(electrode.encoder)) continue;
    const FieldContact touch = contact(electrode, tick.presses);
    force_N_[e] = units::N_from_mN(touch.force_mN);
    if (stopped) depths_[e].reset(touch.depth_mm);
    depths_[e].push(touch.depth_mm);
  }
}

StimulationEncoder::FieldContact StimulationEncoder::contact(
    const Electrode& electrode, std::span<const Press> presses) const noexcept {
  FieldContact all;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const Press& press = presses[i];
    if (patch_of_probe_[i] != electrode.patch || press.contact.depth_mm <= 0.0) continue;
    const double reach_mm = electrode.field_mm[2] + press.contact.contact_radius_mm;
    const double dx_mm = press.x_mm - electrode.field_mm[0];
    const double dy_mm = press.y_mm - electrode.field_mm[1];
    if (dx_mm * dx_mm + dy_mm * dy_mm > reach_mm * reach_mm) continue;
    all.force_mN += press.contact.force_mN;
    // NaN wins over every other depth: the limiter must see it.
    const double depth_mm = press.contact.depth_mm;
    if (std::isnan(depth_mm) || depth_mm > all.depth_mm) all.depth_mm = depth_mm;
  }
  return all;
}

std::size_t StimulationEncoder::collect_pulses(const Tick& tick) noexcept {
  std::size_t pulses = 0;
  // Always sufficient: see EncodedModel::most_spikes.
  const std::size_t room = commands_.size() - parameters_.electrodes.size();
  for (const SpikeEvent& spike : tick.spikes) {
    if (stop_of_patch_[spike.patch] != Stop::kNone) continue;
    for (const FieldActivity::Membership& membership : activity_.memberships(spike)) {
      const Electrode& electrode = parameters_.electrodes[membership.electrode];
      if (electrode.encoder != EncoderKind::kPulsePerSpike || pulses == room) continue;
      commands_[pulses++] = {.time = spike.time,
                             .amplitude_uA = electrode.amplitude_uA[1],
                             .heartbeat = heartbeat_,
                             .electrode = static_cast<std::uint16_t>(membership.electrode),
                             .kind = Kind::kPulse};
    }
  }
  return pulses;
}

StimulationEncoder::Drive StimulationEncoder::drive(std::size_t e) const noexcept {
  const Electrode& electrode = parameters_.electrodes[e];
  const auto both = [](double value) { return Drive{.amplitude = value, .frequency = value}; };
  const auto windowed = [&](double value) { return both(value < kLeastDrive ? 0.0 : value); };
  switch (electrode.encoder) {
    case EncoderKind::kRate:
      return windowed(activity_.rate_Hz(e) / electrode.full_rate_Hz);
    case EncoderKind::kRecruited:
      return windowed(activity_.recruited_share(e));
    case EncoderKind::kPulsePerSpike:
      return {};
    case EncoderKind::kLinear:
      return both(force_N_[e] / electrode.full_force_N);
    case EncoderKind::kOkorokova: {
      const PopulationResponse response = okorokova_response(depths_[e].at_intervals());
      return {.amplitude = response.recruited / electrode.full_population,
              .frequency = response.rate_Hz / electrode.full_population_Hz};
    }
  }
  return {};
}

void StimulationEncoder::update(std::span<StimulationCommand> commands) noexcept {
  ++heartbeat_;
  // A non-finite value stays non-finite: the limiter counts it and switches the electrode off.
  const auto within = [](const std::vector<double>& range, double drive) {
    if (!std::isfinite(drive)) return std::numeric_limits<double>::quiet_NaN();
    return range[0] + (range[1] - range[0]) * std::min(drive, 1.0);
  };
  for (std::size_t e = 0; e < commands.size(); ++e) {
    const Electrode& electrode = parameters_.electrodes[e];
    const Stop stop = stop_of_patch_[electrode.patch];
    StimulationCommand& command = commands[e];
    command = {.time = *last_end_,
               .heartbeat = heartbeat_,
               .electrode = static_cast<std::uint16_t>(e),
               .kind = Kind::kUpdate,
               .stop = stop};
    if (stop != Stop::kNone) continue;
    const Drive wanted = drive(e);
    if (wanted.amplitude <= 0.0) continue;
    command.frequency_Hz = within(electrode.frequency_Hz, wanted.frequency);
    command.amplitude_uA = within(electrode.amplitude_uA, wanted.amplitude);
    if (command.frequency_Hz <= 0.0) command.amplitude_uA = 0.0;
  }
  limiter_.limit_update(commands);
}

}  // namespace merkel
