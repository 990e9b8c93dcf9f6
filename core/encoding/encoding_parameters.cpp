#include "core/encoding/encoding_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/units.hpp"

namespace merkel {
namespace {

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
               "has no default for it");
}

void check_electrode(const Electrode& e, ParameterCheck& check) {
  check.require(is_electrode_name(e.name), "electrode.name",
                "must have 1 to 32 letters, digits, '_', '-' or '.'");
  Electrode copy = e;
  const std::string table = "electrode[" + e.name + "]";
  BoundFields fields;
  bind_fields({.name = table, .fields = Electrode::fields().fields}, &copy, fields);
  check.fields(fields);
  constexpr std::string_view kRange =
      "must be set to [weakest, strongest]: two numbers, the second above 0 and no less than the "
      "first";
  check
      .require(e.field_mm.size() == 3 && e.field_mm.back() > 0.0, e.key("field_mm"),
               "must be [x, y, radius] on the patch, with a positive radius")
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
      .require(e.frequency_Hz[1] * 2.0 * units::s_from(limits.phase) <= 1.0, e.key("frequency_Hz"),
               "reaches " + shortest_decimal(e.frequency_Hz[1]) +
                   " Hz, whose period is shorter than a pulse of two phases of " + phase +
                   ": lower the frequency or shorten " + phase_key);
}

}  // namespace

std::string Electrode::key(std::string_view field) const {
  return "electrode[" + name + "]." + std::string(field);
}

FieldTable Electrode::fields() {
  using E = Electrode;
  static constexpr std::string_view kEncoders[] = {"rate", "recruited", "pulse_per_spike", "linear",
                                                   "okorokova"};
  static constexpr Field kFields[] = {
      {"name", "", any_value(), "name of the electrode: letters, digits, '_', '-' or '.'",
       at<&E::name>},
      {"field_mm", "mm", from_to(-1e4, 1e4),
       "[x, y, radius] on the patch; the electrode represents the afferents inside",
       at<&E::field_mm>},
      {"encoder", "", one_of(kEncoders), "how the touch determines the commands", at<&E::encoder>},
      {"window_ms", "ms", from_to(1.0, 1e4),
       "time constant of the causal exponential window of rate and recruited", at<&E::window>},
      {"amplitude_uA", "µA", not_negative(1e5),
       "[weakest, strongest] amplitude of a phase; must be set", at<&E::amplitude_uA>},
      {"frequency_Hz", "Hz", not_negative(1e4),
       "[weakest, strongest] frequency; the second also limits pulses; must be set",
       at<&E::frequency_Hz>},
      {"full_rate_Hz", "Hz", positive(1e4), "mean rate of an afferent at which rate is strongest",
       at<&E::full_rate_Hz>},
      {"full_force_N", "N", positive(1e4), "force at which linear is strongest",
       at<&E::full_force_N>},
      {"full_population_Hz", "Hz", positive(1e7),
       "population rate at which the frequency of okorokova is strongest",
       at<&E::full_population_Hz>},
      {"full_population", "", positive(1e7),
       "recruited afferents at which the amplitude of okorokova is strongest",
       at<&E::full_population>},
      {"phase_us", "µs", from_to(1.0, 1e4), "length of each phase of its pulses", at<&E::phase>,
       "stimulation.phase_us"},
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
  static constexpr Field kFields[] = {
      {"update_ms", "ms", positive(1e3), "time between updates; a multiple of the tick",
       at<&P::update>},
      {"phase_us", "µs", from_to(1.0, 1e4), "length of each phase of a biphasic pulse",
       at<&P::phase>},
      {"max_charge_nC", "nC", not_negative(1e6),
       "largest charge per phase and electrode; must be set", at<&P::max_charge_nC>},
      {"max_amplitude_uA", "µA", positive(1e5), "largest amplitude of an electrode",
       at<&P::max_amplitude_uA>, "no limit besides the charge"},
      {"frequency_Hz", "Hz", not_negative(1e4),
       "[weakest, strongest] frequency of electrodes that set none", at<&P::frequency_Hz>},
      {"max_total_uA", "µA", not_negative(1e7), "largest sum of all amplitudes; must be set",
       at<&P::max_total_uA>},
      {"watchdog_ms", "ms", not_negative(units::ms_from(kLongestWatchdog)),
       "wall time without a tick or without a new sample after which electrodes are switched off; "
       "at least two ticks; must be set",
       at<&P::watchdog>},
      {"max_slope_uA_per_s", "µA/s", positive(1e9),
       "largest rise of an amplitude; decreases are not limited", at<&P::max_slope_uA_per_s>,
       "no limit"},
      {"max_electrodes", "", from_to(1, kMostElectrodes),
       "most electrodes that stimulate at the same time, the strongest first",
       at<&P::max_electrodes>, "all"}};
  return {"stimulation", kFields};
}

ElectrodeLimits ElectrodeLimits::of(const Electrode& electrode,
                                    const StimulationParameters& scene) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  return {.phase = electrode.phase.value_or(scene.phase),
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

Expected<void, ParameterError> EncodingParameters::check() const {
  ParameterCheck check;
  if (electrodes.empty()) return check.result();
  check.require(electrodes.size() <= kMostElectrodes, "electrode",
                "must not appear more than 256 times");
  check_limits(*this, check);
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
  return check.result();
}

}  // namespace merkel
