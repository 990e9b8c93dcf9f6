#include "core/math/portable_math.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace merkel {

double portable_exp(double x) noexcept {
  // Beyond these limits, the result is 0 or infinite.
  if (x < -746.0) return 0.0;
  if (x > 710.0) return std::numeric_limits<double>::infinity();
  // e^x = 2^k · e^r with |r| ≤ ln2/2; ln2 is split so that k·ln2 keeps full precision.
  constexpr double kLn2High = 6.93147180369123816490e-01;
  constexpr double kLn2Low = 1.90821492927058770002e-10;
  const double k = std::floor(x * std::numbers::log2e + 0.5);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double sum = 1.0;
  for (int n = 18; n >= 1; --n) sum = 1.0 + sum * r / n;
  return std::ldexp(sum, static_cast<int>(k));
}

double portable_expm1(double x) noexcept {
  if (std::fabs(x) > 0.5) return portable_exp(x) - 1.0;
  double sum = 1.0;
  for (int n = 18; n >= 2; --n) sum = 1.0 + sum * x / n;
  return x * sum;
}

double portable_erf(double x) noexcept {
  const double magnitude = std::fabs(x);
  if (magnitude > 6.0) return x < 0.0 ? -1.0 : 1.0;
  const double square = x * x;
  double term = 1.0;
  double sum = 1.0;
  for (int n = 1; term > sum * 1e-17; ++n) {
    term *= 2.0 * square / (2 * n + 1);
    sum += term;
  }
  return 2.0 * std::numbers::inv_sqrtpi * x * portable_exp(-square) * sum;
}

}  // namespace merkel
