#include "core/encoding/encoding_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/units.hpp"

namespace merkel {
namespace {

bool is_positive(double value) { return std::isfinite(value) && value > 0.0; }

bool name_is_plain(std::string_view name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  return !name.empty() && name.size() <= 32 && std::all_of(name.begin(), name.end(), plain);
}

bool is_range(const std::vector<double>& values, double most) {
  return values.size() == 2 && values[0] >= 0.0 && values[0] <= values[1] && values[1] > 0.0 &&
         values[1] <= most;
}

/// "of E12 …"
std::string of(const Electrode& electrode, std::string_view rest) {
  return "of " + electrode.name + " " + std::string(rest);
}

void check_limits(const StimulationParameters& p, ParameterCheck& check) {
  constexpr std::string_view kNoDefault =
      " must be set to a positive number: a scene with electrodes needs this limit, and merkel has "
      "no default for it";
  check
      .require(p.update.count() > 0 && p.update <= std::chrono::seconds{1}, "stimulation.update_ms",
               "must be above 0 and at most 1000 ms")
      .require(p.phase >= std::chrono::microseconds{1} && p.phase <= std::chrono::milliseconds{10},
               "stimulation.phase_us", "must be from 1 to 10000 µs")
      .require(is_positive(p.max_charge_nC), "stimulation.max_charge_nC", kNoDefault.substr(1))
      .require(is_positive(p.max_total_uA), "stimulation.max_total_uA", kNoDefault.substr(1))
      .require(!p.max_slope_uA_per_s || is_positive(*p.max_slope_uA_per_s),
               "stimulation.max_slope_uA_per_s", "must be a positive number; leave it out for none")
      .require(!p.max_electrodes || *p.max_electrodes >= 1, "stimulation.max_electrodes",
               "must be a whole number from 1; leave it out for all");
}

void check_electrode(const Electrode& e, ParameterCheck& check) {
  check
      .require(name_is_plain(e.name), "electrode.name",
               "must have 1 to 32 letters, digits, '_', '-' or '.'")
      .require(e.field_mm.size() == 3 && std::isfinite(e.field_mm[0]) &&
                   std::isfinite(e.field_mm[1]) && is_positive(e.field_mm[2]),
               "electrode.field_mm",
               of(e, "must be [x, y, radius] on the patch, with a positive radius"))
      .require(e.window >= std::chrono::milliseconds{1} && e.window <= std::chrono::seconds{10},
               "electrode.window_ms", of(e, "must be from 1 to 10000 ms"))
      .require(is_range(e.amplitude_uA, 1e5), "electrode.amplitude_uA",
               of(e,
                  "must be set to [weakest, strongest]: two numbers from 0 to 100000, the second "
                  "above 0 and no less than the first"))
      .require(is_range(e.frequency_Hz, 1e4), "electrode.frequency_Hz",
               of(e,
                  "must be set to [weakest, strongest]: two numbers from 0 to 10000, the second "
                  "above 0 and no less than the first"))
      .require(is_positive(e.full_rate_Hz), "electrode.full_rate_Hz", of(e, "must be positive"))
      .require(is_positive(e.full_force_N), "electrode.full_force_N", of(e, "must be positive"))
      .require(is_positive(e.full_population_Hz), "electrode.full_population_Hz",
               of(e, "must be positive"))
      .require(is_positive(e.full_population), "electrode.full_population",
               of(e, "must be positive"));
}

/// The ranges of a valid electrode against valid limits.
void check_ranges(const Electrode& e, const StimulationParameters& p, ParameterCheck& check) {
  const double strongest_uA = e.amplitude_uA[1];
  const double phase_us = units::us_from(p.phase);
  check
      .require(charge_nC(strongest_uA, p.phase) <= p.max_charge_nC, "electrode.amplitude_uA",
               of(e, "reaches " + shortest_decimal(strongest_uA) + " µA, which is " +
                         shortest_decimal(charge_nC(strongest_uA, p.phase)) + " nC in a phase of " +
                         shortest_decimal(phase_us) + " µs, above stimulation.max_charge_nC = " +
                         shortest_decimal(p.max_charge_nC) +
                         ": lower the amplitude or shorten stimulation.phase_us"))
      .require(strongest_uA <= p.max_total_uA, "electrode.amplitude_uA",
               of(e, "reaches " + shortest_decimal(strongest_uA) +
                         " µA, above stimulation.max_total_uA = " +
                         shortest_decimal(p.max_total_uA) + " by itself: lower the amplitude"))
      .require(e.frequency_Hz[1] * 2.0 * units::s_from(p.phase) <= 1.0, "electrode.frequency_Hz",
               of(e, "reaches " + shortest_decimal(e.frequency_Hz[1]) +
                         " Hz, whose period is shorter than a pulse of two phases of " +
                         shortest_decimal(phase_us) +
                         " µs: lower the frequency or shorten stimulation.phase_us"));
}

}  // namespace

double charge_nC(double amplitude_uA, std::chrono::nanoseconds phase) noexcept {
  return amplitude_uA * units::us_from(phase) * 1e-3;
}

Expected<void, ParameterError> EncodingParameters::check() const {
  ParameterCheck check;
  if (electrodes.empty()) return check.result();
  check.require(electrodes.size() <= kMostElectrodes, "electrode",
                "may be given 256 times at most");
  check_limits(stimulation, check);
  for (std::size_t i = 0; i < electrodes.size(); ++i) {
    check_electrode(electrodes[i], check);
    if (!check.result()) return check.result();
    check_ranges(electrodes[i], stimulation, check);
    for (std::size_t j = 0; j < i; ++j) {
      check.require(electrodes[i].name != electrodes[j].name, "electrode.name",
                    of(electrodes[i], "names two electrodes: give each its own"));
    }
  }
  return check.result();
}

}  // namespace merkel
