#pragma once

#include <chrono>
#include <cstdint>

/// All unit conversions of the project. Contact mechanics works in mm, mN and kPa (coherent:
/// kPa = mN/mm² = µJ/mm³), membranes in mV, ms, µA/cm², mS/cm² and µF/cm² (coherent:
/// µA/cm² = mS/cm² · mV = µF/cm² · mV/ms). Time crosses interfaces as std::chrono.
namespace merkel::units {

using Nanoseconds = std::chrono::nanoseconds;

[[nodiscard]] constexpr double mN_from_N(double force_N) { return force_N * 1e3; }
[[nodiscard]] constexpr double N_from_mN(double force_mN) { return force_mN * 1e-3; }
[[nodiscard]] constexpr double mm_from_um(double length_um) { return length_um * 1e-3; }
[[nodiscard]] constexpr double um_from_mm(double length_mm) { return length_mm * 1e3; }
[[nodiscard]] constexpr double ms_from(Nanoseconds time) {
  return static_cast<double>(time.count()) / 1e6;
}
[[nodiscard]] constexpr double us_from(Nanoseconds time) {
  return static_cast<double>(time.count()) / 1e3;
}
[[nodiscard]] constexpr double s_from(Nanoseconds time) {
  return static_cast<double>(time.count()) / 1e9;
}

/// Exact by definition of the pound (1959), the kilogram-force and the inch.
inline constexpr double kN_per_kgf = 9.80665;
inline constexpr double kN_per_lbf = 4.4482216152605;
inline constexpr double kN_per_ozf = kN_per_lbf / 16.0;
inline constexpr double kMm_per_inch = 25.4;

/// Nearest whole nanosecond; the argument must be within ±9.2e9 s.
[[nodiscard]] constexpr Nanoseconds nanoseconds_from_s(double time_s) {
  const double time_ns = time_s * 1e9;
  return Nanoseconds{static_cast<std::int64_t>(time_ns + (time_ns < 0 ? -0.5 : 0.5))};
}
[[nodiscard]] constexpr Nanoseconds nanoseconds_from_us(double time_us) {
  return nanoseconds_from_s(time_us * 1e-6);
}
[[nodiscard]] constexpr Nanoseconds nanoseconds_from_ms(double time_ms) {
  return nanoseconds_from_s(time_ms * 1e-3);
}

static_assert(mN_from_N(1.0) == 1000.0);
static_assert(N_from_mN(mN_from_N(0.25)) == 0.25);
static_assert(um_from_mm(mm_from_um(5.0)) == 5.0);
static_assert(ms_from(std::chrono::microseconds{25}) == 0.025);
static_assert(s_from(std::chrono::seconds{2}) == 2.0);
static_assert(nanoseconds_from_us(12.5) == Nanoseconds{12500});
static_assert(nanoseconds_from_ms(-1.0) == Nanoseconds{-1000000});

}  // namespace merkel::units
