#include "core/encoding/stimulation_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "core/records/probe_sample.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;
using State = TickRecord::State;

/// The onset of a press lasts 20 ms in the afferents of the presets.
constexpr nanoseconds kSettling{50'000'000};
/// Smaller drives count as off, because an exponential window never decays to 0.
constexpr double kMinDrive = 0.01;

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
                   .max_slope_uA_per_s = limits.max_slope_uA_per_s,
                   .pulse = limits.pulse,
                   .group = each.group.value_or(StimulationLimiter::kNoGroup)});
  }
  return all;
}

/// The shortest time between two pulses of a group: they never fall in one tick.
nanoseconds group_gap(const EncodingParameters& parameters, std::size_t group, nanoseconds tick) {
  nanoseconds gap = tick;
  for (const Electrode& each : parameters.electrodes) {
    if (each.group != group) continue;
    gap = std::max(gap, ElectrodeLimits::of(each, parameters.stimulation).pulse);
  }
  return gap;
}

StimulationLimiter::Limits limits_of(const EncodingParameters& parameters, nanoseconds tick) {
  const StimulationParameters& p = parameters.stimulation;
  StimulationLimiter::Limits limits{.max_total_uA = p.max_total_uA};
  if (p.max_electrodes) limits.max_electrodes = static_cast<std::size_t>(*p.max_electrodes);
  for (std::size_t g = 0; g < parameters.groups.size(); ++g) {
    limits.groups.push_back(
        {.gap = group_gap(parameters, g, tick),
         .max_charge_nC_per_s =
             parameters.groups[g].max_charge_nC_per_s.value_or(StimulationLimiter::kNone)});
  }
  return limits;
}

/// \param doubts  ProbeSample::Doubt bits
Stop suspension_of(std::uint32_t doubts) {
  if ((doubts & ProbeSample::kZeroUncertain) != 0U) return Stop::kZeroUncertain;
  if ((doubts & ProbeSample::kOutsideCalibration) != 0U) return Stop::kOutsideCalibration;
  return Stop::kNone;
}

/// Largest number of pulses in a tick before the limiter.
std::size_t most_pulses(const EncoderSources& encoding, const EncodedModel& model,
                        const FieldActivity& activity, std::size_t groups) {
  std::size_t most = groups;
  for (std::size_t s = 0; s < encoding.sources.size(); ++s) {
    if (encoding.sources[s].settings.encoder == EncoderKind::kPulsePerSpike) {
      most += activity.afferents(s) * model.most_spikes;
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
                    " ms: " + shortest_decimal(units::ms_from(2 * model.tick)) +
                    " ms, or shorten loop.tick_us");
  for (std::size_t g = 0; g < parameters.groups.size(); ++g) {
    const ElectrodeGroup& group = parameters.groups[g];
    const nanoseconds gap = group_gap(parameters, g, model.tick);
    const auto members = static_cast<double>(parameters.members(g));
    const double most_Hz = 1e9 / static_cast<double>(gap.count()) / members;
    check.require(group.pattern.frequency_Hz[1] <= most_Hz, group.key("frequency_Hz"),
                  "is too high to stagger the pulses of " + shortest_decimal(members) +
                      " electrodes: with " + shortest_decimal(units::ms_from(gap)) +
                      " ms between two pulses (a tick and a pulse, whichever is longer), it is at "
                      "most " +
                      shortest_decimal(std::floor(most_Hz)));
  }
  for (const Electrode& each : parameters.electrodes) {
    const bool known = each.patch < model.patches.size();
    check.require(known, each.key("patch"), "is not a patch of the scene");
    check.require(
        !known || !model.patches[each.patch].array || each.encoder != EncoderKind::kOkorokova,
        each.key("encoder"),
        "= \"okorokova\" needs the depth of a press, which a tactile array does not measure: use "
        "another one");
    check.require(
        known && model.patches[each.patch].area.contains(each.field_mm[0], each.field_mm[1]),
        each.key("field_mm"), "has its centre outside the patch");
  }
  return check.result();
}

Expected<void, ParameterError> check_fields(const EncodingParameters& parameters,
                                            const EncoderSources& encoding,
                                            const FieldActivity& activity) {
  ParameterCheck check;
  for (std::size_t s = 0; s < encoding.sources.size(); ++s) {
    const Electrode& first = parameters.electrodes[encoding.first_electrode[s]];
    check.require(
        !counts_spikes(first.encoder) || activity.afferents(s) > 0,
        first.group ? parameters.groups[*first.group].key("field_mm") : first.key("field_mm"),
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
  if (const auto checked = check_fields(parameters, encoder.encoding_, encoder.activity_);
      !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  return encoder;
}

StimulationEncoder::StimulationEncoder(const EncodingParameters& parameters,
                                       const EncodedModel& model)
    : parameters_(parameters),
      tick_(model.tick),
      patch_of_probe_(model.patch_of_probe),
      encoding_(parameters),
      activity_(encoding_.sources, model),
      touch_(encoding_.sources, model),
      group_pulses_(parameters),
      own_(encoding_.sources.size()),
      limiter_(limits_of(parameters, model.tick), limits_of_electrodes(parameters)),
      steps_(parameters),
      stop_of_patch_(model.patches.size()),
      settled_(model.patches.size()),
      commands_(parameters.electrodes.size() +
                most_pulses(encoding_, model, activity_, parameters.groups.size())) {}

void StimulationEncoder::reset() noexcept {
  activity_.reset();
  group_pulses_.reset();
  std::fill(own_.begin(), own_.end(), OwnDrive{});
  std::fill(stop_of_patch_.begin(), stop_of_patch_.end(), Stop::kNone);
  last_end_.reset();
  heartbeat_ = 0;
  stops_ = 0;
  latched_ = Stop::kNone;
}

void StimulationEncoder::set_drive(const GivenDrive& given) noexcept {
  if (given.electrode >= parameters_.electrodes.size()) return;
  own_[encoding_.of_electrode[given.electrode]] = {
      {.amplitude = given.amplitude, .frequency = given.frequency},
      given.time + parameters_.stimulation.watchdog};
}

std::span<const StimulationCommand> StimulationEncoder::step(const Tick& tick) noexcept {
  const nanoseconds end = tick.records.front().time;
  const bool first = !last_end_;
  if (first) {
    limiter_.reset(end - tick_);
    next_update_ = end;
    find_presses(tick);
  }
  const bool stopped = find_stops(tick);
  if (stopped) ++stops_;
  last_end_ = end;
  activity_.advance(tick.spikes, end);
  advance_histories(tick, first);
  const std::size_t pulses = steps_.round_pulses(std::span(commands_).first(
      limiter_.limit_pulses(std::span(commands_).first(collect_pulses(tick)), end - tick_)));
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
      if (patch_of_probe_[record.probe] == patch && stop == Stop::kNone) {
        stop = suspension_of(record.doubts);
      }
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

/// Of the first tick.
void StimulationEncoder::find_presses(const Tick& tick) noexcept {
  const nanoseconds begin = tick.records.front().time - tick_;
  std::fill(settled_.begin(), settled_.end(), nanoseconds::min());
  for (std::size_t i = 0; i < tick.presses.size(); ++i) {
    if (tick.presses[i].touching()) settled_[patch_of_probe_[i]] = begin + kSettling;
  }
}

/// \param first  what came before is unknown: a press that begins there is no onset
void StimulationEncoder::advance_histories(const Tick& tick, bool first) noexcept {
  for (std::size_t s = 0; s < encoding_.sources.size(); ++s) {
    const Electrode& settings = encoding_.sources[s].settings;
    const bool stopped = stop_of_patch_[settings.patch] != Stop::kNone;
    if (stopped || tick.records.front().time <= settled_[settings.patch]) activity_.reset(s);
    if (!counts_spikes(settings.encoder)) touch_.advance(s, tick.presses, stopped || first);
  }
}

std::size_t StimulationEncoder::collect_pulses(const Tick& tick) noexcept {
  std::size_t pulses = 0;
  // Always sufficient: see EncodedModel::most_spikes.
  const std::size_t room = commands_.size() - parameters_.electrodes.size();
  for (const SpikeEvent& spike : tick.spikes) {
    if (stop_of_patch_[spike.patch] != Stop::kNone || spike.time <= settled_[spike.patch]) continue;
    for (const FieldActivity::Membership& membership : activity_.memberships(spike)) {
      const EncoderSource& source = encoding_.sources[membership.source];
      if (source.settings.encoder != EncoderKind::kPulsePerSpike || pulses == room) continue;
      commands_[pulses++] = {
          .time = spike.time,
          .amplitude_uA = source.settings.amplitude_uA[1],
          .heartbeat = heartbeat_,
          .electrode = static_cast<std::uint16_t>(encoding_.first_electrode[membership.source]),
          .kind = Kind::kPulse};
    }
  }
  group_pulses_.stop(stop_of_patch_);
  const nanoseconds end = tick.records.front().time;
  return group_pulses_.append(commands_, pulses, end - tick_, end, heartbeat_);
}

StimulationEncoder::Drive StimulationEncoder::drive(std::size_t source) const noexcept {
  const Electrode& settings = encoding_.sources[source].settings;
  const auto both = [](double value) { return Drive{.amplitude = value, .frequency = value}; };
  const auto windowed = [&](double value) { return both(value < kMinDrive ? 0.0 : value); };
  switch (settings.encoder) {
    case EncoderKind::kRate:
      return windowed(activity_.rate_Hz(source) / settings.full_rate_Hz);
    case EncoderKind::kRecruited:
      return windowed(activity_.recruited_share(source));
    case EncoderKind::kPulsePerSpike:
      return {};
    case EncoderKind::kLinear:
      return both(touch_.force_N(source) / settings.full_force_N);
    case EncoderKind::kOkorokova: {
      const PopulationResponse response = okorokova_response(touch_.depths_mm(source));
      return {.amplitude = response.recruited / settings.full_population,
              .frequency = response.rate_Hz / settings.full_population_Hz};
    }
    case EncoderKind::kLinearAmplitude:
      return {.amplitude = touch_.force_N(source) / settings.full_force_N, .frequency = 1.0};
    case EncoderKind::kBiomimetic: {
      const double sustained =
          settings.sustained_share * touch_.force_N(source) / settings.full_force_N;
      const double changing =
          std::fabs(touch_.force_rate_N_per_s(source)) / settings.full_force_rate_N_per_s;
      const double amplitude = sustained + changing;
      return {.amplitude = amplitude < kMinDrive ? 0.0 : amplitude, .frequency = 1.0};
    }
    case EncoderKind::kOwn:
      return own_[source];
  }
  return {};
}

void StimulationEncoder::update(std::span<StimulationCommand> commands) noexcept {
  ++heartbeat_;
  // A non-finite value stays non-finite: the limiter counts it and switches the electrode off.
  const auto within = [](const std::vector<double>& range, double drive) {
    if (!std::isfinite(drive)) return std::numeric_limits<double>::quiet_NaN();
    return range[0] + (range[1] - range[0]) * std::clamp(drive, 0.0, 1.0);
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
    const std::size_t source = encoding_.of_electrode[e];
    if (electrode.encoder == EncoderKind::kOwn && *last_end_ >= own_[source].valid_until) {
      command.stop = Stop::kNoDrive;
      continue;
    }
    const Drive wanted = drive(source);
    if (wanted.amplitude <= 0.0) continue;
    command.frequency_Hz = within(electrode.frequency_Hz, wanted.frequency);
    command.amplitude_uA = within(electrode.amplitude_uA, wanted.amplitude);
    if (command.frequency_Hz <= 0.0) command.amplitude_uA = 0.0;
  }
  group_pulses_.take(commands);
  limiter_.limit_update(commands);
  steps_.round_down(commands);
}

}  // namespace merkel
