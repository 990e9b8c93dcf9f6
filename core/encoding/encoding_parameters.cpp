#include "core/encoding/encoding_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/units.hpp"

namespace merkel {
namespace {

constexpr std::string_view kRange =
    "must be set to [weakest, strongest]: two numbers, the second above 0 and no less than the "
    "first";
constexpr std::string_view kDisc = "must be [x, y, radius] on the patch, with a positive radius";

bool is_disc(const std::vector<double>& values) { return values.size() == 3 && values[2] > 0.0; }

bool is_range(const std::vector<double>& values) {
  return values.size() == 2 && values[0] <= values[1] && values[1] > 0.0;
}

void check_limits(const EncodingParameters& encoding, ParameterCheck& check) {
  const StimulationParameters& p = encoding.stimulation;
  constexpr std::string_view kNoDefault =
      "must be set to a positive number: a scene with electrodes needs this limit, and merkel has "
      "no default for it";
  const bool own_charges =
      std::all_of(encoding.electrodes.begin(), encoding.electrodes.end(),
                  [](const Electrode& e) { return e.max_charge_nC.has_value(); });
  check.fields(p)
      .require(p.max_charge_nC > 0.0 || own_charges, "stimulation.max_charge_nC", kNoDefault)
      .require(p.max_total_uA > 0.0, "stimulation.max_total_uA", kNoDefault)
      .require(p.watchdog > std::chrono::nanoseconds{0}, "stimulation.watchdog_ms",
               "must be set, for example watchdog_ms = 100: a scene with electrodes needs the time "
               "after which they are switched off when the simulation or a probe stops, and merkel "
               "has no default for it")
      .require(p.update < p.watchdog, "stimulation.update_ms",
               "must be shorter than stimulation.watchdog_ms = " +
                   shortest_decimal(units::ms_from(p.watchdog)) +
                   ": a command is valid for the watchdog, so electrodes would be off until the "
                   "next update");
}

void check_electrode(const Electrode& e, ParameterCheck& check) {
  check.require(is_electrode_name(e.name), "electrode.name",
                "must have 1 to 32 letters, digits, '_', '-' or '.'");
  Electrode copy = e;
  const std::string table = "electrode[" + e.name + "]";
  BoundFields fields;
  bind_fields({.name = table, .fields = Electrode::source_fields().fields}, &copy, fields);
  bind_fields({.name = table, .fields = Electrode::fields().fields}, &copy, fields);
  check.fields(fields);
  check.require(is_disc(e.field_mm), e.key("field_mm"), kDisc)
      .require(e.border_mm == 0.0 || e.encoder != EncoderKind::kPulsePerSpike, e.key("border_mm"),
               "has no effect on pulse_per_spike: remove it")
      .require(is_range(e.amplitude_uA), e.key("amplitude_uA"), kRange)
      .require(is_range(e.frequency_Hz), e.key("frequency_Hz"), kRange);
}

/// Checks the ranges of a valid electrode against valid limits.
void check_ranges(const Electrode& e, const StimulationParameters& p, ParameterCheck& check) {
  const ElectrodeLimits limits = ElectrodeLimits::of(e, p);
  const double strongest_uA = e.amplitude_uA[1];
  const std::string reaches = "reaches " + shortest_decimal(strongest_uA) + " µA, ";
  const std::string phase = shortest_decimal(units::us_from(limits.phase)) + " µs";
  const auto key = [&](std::string_view field, bool own) {
    return own ? e.key(field) : "stimulation." + std::string(field);
  };
  const std::string phase_key = key("phase_us", e.phase.has_value());
  const std::string charge_key = key("max_charge_nC", e.max_charge_nC.has_value());
  const std::string amplitude_key = key("max_amplitude_uA", e.max_amplitude_uA.has_value());
  check
      .require(strongest_uA <= limits.max_amplitude_uA, e.key("amplitude_uA"),
               reaches + "above " + amplitude_key + " = " +
                   shortest_decimal(limits.max_amplitude_uA) + ": lower the amplitude")
      .require(charge_nC(strongest_uA, limits.phase) <= limits.max_charge_nC, e.key("amplitude_uA"),
               reaches + "which is " + shortest_decimal(charge_nC(strongest_uA, limits.phase)) +
                   " nC in a phase of " + phase + ", above " + charge_key + " = " +
                   shortest_decimal(limits.max_charge_nC) + ": lower the amplitude or shorten " +
                   phase_key)
      .require(strongest_uA <= p.max_total_uA, e.key("amplitude_uA"),
               reaches + "above stimulation.max_total_uA = " + shortest_decimal(p.max_total_uA) +
                   " by itself: lower the amplitude")
      .require(limits.second_phase >= limits.phase, "stimulation.second_phase_us",
               "is shorter than the first phase of " + e.name + ", " + phase +
                   ", so that the second needs more current than the first: lengthen it")
      .require(e.frequency_Hz[1] * units::s_from(limits.pulse) <= 1.0, e.key("frequency_Hz"),
               "reaches " + shortest_decimal(e.frequency_Hz[1]) +
                   " Hz, whose period is shorter than a pulse of two phases of " + phase +
                   ": lower the frequency or shorten " + phase_key);
}

void check_group(const EncodingParameters& encoding, std::size_t number, ParameterCheck& check) {
  const ElectrodeGroup& group = encoding.groups[number];
  const Electrode& pattern = group.pattern;
  check.require(is_electrode_name(pattern.name), "electrode_group.name",
                "must be set to 1 to 32 letters, digits, '_', '-' or '.'");
  ElectrodeGroup copy = group;
  const std::string table = "electrode_group[" + pattern.name + "]";
  BoundFields fields;
  bind_fields({.name = table, .fields = Electrode::source_fields().fields}, &copy.pattern, fields);
  bind_fields({.name = table, .fields = ElectrodeGroup::fields().fields}, &copy, fields);
  check.fields(fields)
      .require(pattern.field_mm.empty() || is_disc(pattern.field_mm), group.key("field_mm"), kDisc)
      .require(is_range(pattern.frequency_Hz), group.key("frequency_Hz"), kRange)
      .require(pattern.encoder != EncoderKind::kPulsePerSpike, group.key("encoder"),
               "must not be pulse_per_spike, because pulses of a group are staggered: use rate")
      .require(
          encoding.members(number) >= 2, group.key("name"),
          "must be that of at least two electrodes: give them group = \"" + pattern.name + "\"");
  const Electrode* first = nullptr;
  for (const Electrode& each : encoding.electrodes) {
    if (each.group != number) continue;
    if (first == nullptr) first = &each;
    check
        .require(each.patch == first->patch, each.key("patch"),
                 "must be that of " + first->name + ", which is in the same group")
        .require(each.frequency_Hz == pattern.frequency_Hz, each.key("frequency_Hz"),
                 "must be that of its group");
  }
  for (std::size_t other = 0; other < number; ++other) {
    check.require(pattern.name != encoding.groups[other].pattern.name, "electrode_group.name",
                  "\"" + pattern.name + "\" is used by two groups: give each its own name");
  }
}

}  // namespace

std::string Electrode::key(std::string_view field) const {
  return "electrode[" + name + "]." + std::string(field);
}

std::string ElectrodeGroup::key(std::string_view field) const {
  return "electrode_group[" + pattern.name + "]." + std::string(field);
}

FieldTable Electrode::source_fields() {
  using E = Electrode;
  static constexpr std::string_view kEncoders[] = {"rate",       "recruited", "pulse_per_spike",
                                                   "linear",     "okorokova", "linear_amplitude",
                                                   "biomimetic", "own"};
  static constexpr Field kFields[] = {
      {"name", "", any_value(), "name: letters, digits, '_', '-' or '.'", at<&E::name>},
      {"field_mm", "mm", from_to(-1e4, 1e4),
       "[x, y, radius] on the patch; it represents the afferents inside", at<&E::field_mm>},
      {"border_mm", "mm", not_negative(1e4),
       "width over which the weight of the field falls from 1 at its radius to 0",
       at<&E::border_mm>},
      {"encoder", "", one_of(kEncoders), "how the touch determines the commands", at<&E::encoder>},
      {"window_ms", "ms", from_to(1.0, 1e4),
       "time constant of the causal exponential window of rate and recruited", at<&E::window>},
      {"frequency_Hz", "Hz", not_negative(1e4),
       "[weakest, strongest] frequency; the second also limits pulses; must be set",
       at<&E::frequency_Hz>},
      {"full_rate_Hz", "Hz", positive(1e4), "mean rate of an afferent at which rate is strongest",
       at<&E::full_rate_Hz>},
      {"full_force_N", "N", positive(1e4),
       "force at which linear and linear_amplitude are strongest", at<&E::full_force_N>},
      {"sustained_share", "", from_to(0.0, 1.0),
       "drive of biomimetic at full_force_N while the force does not change",
       at<&E::sustained_share>},
      {"full_force_rate_N_per_s", "N/s", positive(1e6),
       "change of force at which biomimetic is strongest, at onset and offset",
       at<&E::full_force_rate_N_per_s>},
      {"full_population_Hz", "Hz", positive(1e7),
       "population rate at which the frequency of okorokova is strongest",
       at<&E::full_population_Hz>},
      {"full_population", "", positive(1e7),
       "recruited afferents at which the amplitude of okorokova is strongest",
       at<&E::full_population>}};
  return {"electrode", kFields};
}

FieldTable ElectrodeGroup::fields() {
  static constexpr Field kFields[] = {
      {"max_charge_nC_per_s", "nC/s", positive(1e9),
       "largest charge of its electrodes together in any second, of one phase of each pulse",
       at<&ElectrodeGroup::max_charge_nC_per_s>, "no limit"}};
  return {"electrode_group", kFields};
}

FieldTable Electrode::fields() {
  using E = Electrode;
  static constexpr Field kFields[] = {
      {"amplitude_uA", "µA", not_negative(1e5),
       "[weakest, strongest] amplitude of a phase; must be set", at<&E::amplitude_uA>},
      {"group_weight", "", from_to(0.0, 1.0), "weight of its field in the field of its group",
       at<&E::group_weight>},
      {"phase_us", "µs", from_to(1.0, 1e4), "length of the first phase of its pulses",
       at<&E::phase>, "stimulation.phase_us"},
      {"max_charge_nC", "nC", positive(1e6), "its largest charge per phase", at<&E::max_charge_nC>,
       "stimulation.max_charge_nC"},
      {"max_amplitude_uA", "µA", positive(1e5), "its largest amplitude", at<&E::max_amplitude_uA>,
       "stimulation.max_amplitude_uA"},
      {"max_slope_uA_per_s", "µA/s", positive(1e9), "the largest rise of its amplitude",
       at<&E::max_slope_uA_per_s>, "stimulation.max_slope_uA_per_s"}};
  return {"electrode", kFields};
}

FieldTable StimulationParameters::fields() {
  using P = StimulationParameters;
  static constexpr std::string_view kPolarities[] = {"cathodic_first", "anodic_first"};
  static constexpr Field kFields[] = {
      {"update_ms", "ms", positive(1e3), "time between updates; a multiple of the tick",
       at<&P::update>},
      {"phase_us", "µs", from_to(1.0, 1e4), "length of the first phase of a biphasic pulse",
       at<&P::phase>},
      {"second_phase_us", "µs", from_to(1.0, 1e5),
       "length of the second phase, which returns the charge; not shorter than the first",
       at<&P::second_phase>, "that of the first"},
      {"interphase_us", "µs", not_negative(1e5), "time between the phases", at<&P::interphase>},
      {"polarity", "", one_of(kPolarities), "the phase that comes first", at<&P::polarity>},
      {"max_charge_nC", "nC", not_negative(1e6),
       "largest charge per phase and electrode; must be set", at<&P::max_charge_nC>},
      {"max_amplitude_uA", "µA", positive(1e5), "largest amplitude of an electrode",
       at<&P::max_amplitude_uA>, "no limit besides the charge"},
      {"frequency_Hz", "Hz", not_negative(1e4),
       "[weakest, strongest] frequency of electrodes that set none", at<&P::frequency_Hz>},
      {"max_total_uA", "µA", not_negative(1e7), "largest sum of all amplitudes; must be set",
       at<&P::max_total_uA>},
      {"watchdog_ms", "ms", not_negative(units::ms_from(kMaxWatchdog)),
       "wall time without a tick or without a new sample after which electrodes are switched off; "
       "at least two ticks; must be set",
       at<&P::watchdog>},
      {"max_slope_uA_per_s", "µA/s", positive(1e9),
       "largest rise of an amplitude; decreases are not limited", at<&P::max_slope_uA_per_s>,
       "no limit"},
      {"max_electrodes", "", from_to(1, kMaxElectrodes),
       "most electrodes that stimulate at the same time, the strongest first",
       at<&P::max_electrodes>, "all"},
      {"profile", "", any_value(),
       "stimulator whose ranges and steps apply, as if [stimulator] held them: cerestim, "
       "grapevine, or a file like tools/scene/stimulators/cerestim.toml",
       at<&P::profile>, "[stimulator]"}};
  return {"stimulation", kFields};
}

ElectrodeLimits ElectrodeLimits::of(const Electrode& electrode,
                                    const StimulationParameters& scene) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const std::chrono::nanoseconds phase = electrode.phase.value_or(scene.phase);
  const std::chrono::nanoseconds second = scene.second_phase.value_or(phase);
  return {.phase = phase,
          .second_phase = second,
          .pulse = phase + scene.interphase + second,
          .max_charge_nC = electrode.max_charge_nC.value_or(scene.max_charge_nC),
          .max_amplitude_uA =
              electrode.max_amplitude_uA.value_or(scene.max_amplitude_uA.value_or(kNone)),
          .max_slope_uA_per_s =
              electrode.max_slope_uA_per_s.value_or(scene.max_slope_uA_per_s.value_or(kNone))};
}

bool is_electrode_name(std::string_view name) noexcept {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  return !name.empty() && name.size() <= 32 && std::all_of(name.begin(), name.end(), plain);
}

double charge_nC(double amplitude_uA, std::chrono::nanoseconds phase) noexcept {
  return amplitude_uA * units::us_from(phase) * 1e-3;
}

std::size_t EncodingParameters::members(std::size_t group) const noexcept {
  return static_cast<std::size_t>(
      std::count_if(electrodes.begin(), electrodes.end(),
                    [group](const Electrode& each) { return each.group == group; }));
}

void EncodingParameters::join_groups() {
  for (Electrode& each : electrodes) {
    if (!each.group) continue;
    const Electrode own = each;
    each = groups[*each.group].pattern;
    each.name = own.name;
    each.patch = own.patch;
    if (each.field_mm.empty()) each.field_mm = own.field_mm;
    each.amplitude_uA = own.amplitude_uA;
    each.group = own.group;
    each.group_weight = own.group_weight;
    each.phase = own.phase;
    each.max_charge_nC = own.max_charge_nC;
    each.max_amplitude_uA = own.max_amplitude_uA;
    each.max_slope_uA_per_s = own.max_slope_uA_per_s;
  }
}

Expected<GivenDrive, std::string> EncodingParameters::own_drive(std::string_view name,
                                                                double amplitude,
                                                                double frequency) const {
  const auto found = std::find_if(electrodes.begin(), electrodes.end(), [&](const Electrode& each) {
    return each.name == name && each.encoder == EncoderKind::kOwn;
  });
  if (found == electrodes.end()) {
    return Unexpected<std::string>("the scene has no electrode \"" + std::string(name) +
                                   "\" with encoder = \"own\": set that in its [[electrode]] or "
                                   "[[electrode_group]]");
  }
  if (!std::isfinite(amplitude) || !std::isfinite(frequency)) {
    return Unexpected<std::string>("the drive of " + found->name +
                                   " is not a finite number: give 0 (off) to 1 (strongest)");
  }
  return GivenDrive{.amplitude = amplitude,
                    .frequency = frequency,
                    .electrode = static_cast<std::uint16_t>(found - electrodes.begin())};
}

Expected<void, ParameterError> EncodingParameters::check() const {
  ParameterCheck check;
  if (electrodes.empty()) {
    return check
        .require(groups.empty(), "electrode_group.name",
                 "has no electrodes: add [[electrode]] with group = \"NAME\", or remove it")
        .result();
  }
  for (const Electrode& each : electrodes) {
    check.require(!each.group || *each.group < groups.size(), each.key("group"),
                  "is not a group of the scene");
  }
  if (!check.result()) return check.result();
  check.require(electrodes.size() <= kMaxElectrodes, "electrode",
                "must not appear more than 256 times");
  check_limits(*this, check);
  for (std::size_t g = 0; g < groups.size(); ++g) check_group(*this, g, check);
  if (!check.result()) return check.result();
  for (std::size_t i = 0; i < electrodes.size(); ++i) {
    check_electrode(electrodes[i], check);
    if (!check.result()) return check.result();
    check_ranges(electrodes[i], stimulation, check);
    for (std::size_t j = 0; j < i; ++j) {
      check.require(
          electrodes[i].name != electrodes[j].name, "electrode.name",
          "\"" + electrodes[i].name + "\" is used by two electrodes: give each its own name");
    }
  }
  return check.also(stimulator.check(*this)).result();
}

}  // namespace merkel
