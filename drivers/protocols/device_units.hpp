#pragma once

#include <optional>
#include <string_view>

namespace merkel {

/// What one of a unit is in N, by the names that instruments use in any case: N, mN, kN, lbF, ozF,
/// kgF, gF. Nothing for any other.
[[nodiscard]] std::optional<double> newtons_per(std::string_view unit) noexcept;

/// The same in mm: mm, um, m, in.
[[nodiscard]] std::optional<double> millimetres_per(std::string_view unit) noexcept;

/// The names above, for error messages.
inline constexpr std::string_view kForceUnits = "N, mN, kN, lbF, ozF, kgF, gF";
inline constexpr std::string_view kLengthUnits = "mm, um, m, in";

}  // namespace merkel
