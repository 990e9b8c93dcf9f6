#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace merkel {

/// What a unit measures. An amplifier or a converter delivers volts or counts, which a factor makes
/// a force, a length or a pressure (unit_factors.hpp). A sync line has no unit: it is 0 or 1.
enum class Quantity : std::uint8_t { kForce, kLength, kPressure, kVoltage, kCount, kSync };

/// A unit: its factor to N, mm, kPa, V or counts.
struct Unit {
  Quantity quantity = Quantity::kForce;
  double factor = 1.0;

  [[nodiscard]] bool is_electrical() const noexcept {
    return quantity == Quantity::kVoltage || quantity == Quantity::kCount;
  }
};

/// A unit by the names that instruments use, in any case: N, mN, kN, lbF, ozF, kgF, gF; mm, um, m,
/// cm, in; kPa, Pa, hPa, MPa, mbar, bar, psi, mmHg; V, mV, uV; count. Empty for any other name.
[[nodiscard]] std::optional<Unit> unit_named(std::string_view name) noexcept;

/// The factor of a unit, if it is one of that quantity.
[[nodiscard]] std::optional<double> factor_to(Quantity quantity, std::string_view unit) noexcept;

/// "N", "mm", "kPa", "V" or "count".
[[nodiscard]] std::string_view unit_of(Quantity quantity) noexcept;

/// The names above, for error messages.
inline constexpr std::string_view kForceUnits = "N, mN, kN, lbF, ozF, kgF, gF";
inline constexpr std::string_view kLengthUnits = "mm, um, cm, m, in";
inline constexpr std::string_view kPressureUnits = "kPa, Pa, hPa, MPa, mbar, bar, psi, mmHg";

}  // namespace merkel
