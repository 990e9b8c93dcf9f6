#pragma once

#include <optional>
#include <string_view>

namespace merkel {

/// A unit in N, by the names that instruments use, in any case: N, mN, kN, lbF, ozF, kgF, gF. Empty
/// for any other name.
[[nodiscard]] std::optional<double> newtons_per(std::string_view unit) noexcept;

/// A unit in kPa: kPa, Pa, hPa, MPa, mbar, bar, psi, mmHg.
[[nodiscard]] std::optional<double> kilopascals_per(std::string_view unit) noexcept;

/// A unit in mm: mm, um, m, in.
[[nodiscard]] std::optional<double> millimetres_per(std::string_view unit) noexcept;

/// The names above, for error messages.
inline constexpr std::string_view kForceUnits = "N, mN, kN, lbF, ozF, kgF, gF";
inline constexpr std::string_view kLengthUnits = "mm, um, m, in";
inline constexpr std::string_view kPressureUnits = "kPa, Pa, hPa, MPa, mbar, bar, psi, mmHg";

}  // namespace merkel
