#include "core/normal_random.hpp"

#include <bit>
#include <cmath>
#include <numbers>

#include "core/random.hpp"

namespace merkel {
namespace {

constexpr std::uint64_t kOne = 0x3ff0000000000000U;

/// ln x for x in (0, 1]: x = 2^e·m, m in [√½, √2); ln m = 2·artanh((m−1)/(m+1)).
double logarithm(double x) noexcept {
  const std::uint64_t shifted = std::bit_cast<std::uint64_t>(x) + (kOne - 0x3fe6a09e00000000U);
  const double e = static_cast<double>(shifted >> 52U) - 1023.0;
  const auto m = std::bit_cast<double>((shifted & 0x000fffffffffffffU) + 0x3fe6a09e00000000U);
  const double s = (m - 1.0) / (m + 1.0);
  const double z = s * s;
  double sum = 1.0 / 19;
  for (int k = 17; k >= 1; k -= 2) sum = sum * z + 1.0 / k;
  return e * std::numbers::ln2 + (s + s) * sum;
}

}  // namespace

std::uint64_t normal_key(std::uint64_t seed, std::uint64_t pair) noexcept {
  return Random::mix(Random(seed).next() + pair);
}

double normal_random(std::uint64_t seed, std::uint64_t stream, std::uint64_t step) noexcept {
  const NormalStream of = NormalStream::of(stream);
  const std::uint64_t word =
      Random::mix(normal_key(seed, of.pair) + (step + 1) * Random::kIncrement);
  const double u = 2.0 - std::bit_cast<double>((word >> 32U << 20U) | kOne);
  const double turns = std::bit_cast<double>((word << 32U >> 12U) | kOne) - 1.0;
  const double radius = std::sqrt(-2.0 * logarithm(u));
  const double quarters = 4.0 * turns;
  const double q = std::floor(quarters + 0.5);
  const double f = (quarters - q) * (0.5 * std::numbers::pi);
  const double f2 = f * f;
  double sine = -1.0 / 1307674368000.0;
  double cosine = 1.0 / 20922789888000.0;
  constexpr double kSine[] = {1.0 / 6227020800.0,
                              -1.0 / 39916800.0,
                              1.0 / 362880.0,
                              -1.0 / 5040.0,
                              1.0 / 120.0,
                              -1.0 / 6.0,
                              1.0};
  constexpr double kCosine[] = {-1.0 / 87178291200.0,
                                1.0 / 479001600.0,
                                -1.0 / 3628800.0,
                                1.0 / 40320.0,
                                -1.0 / 720.0,
                                1.0 / 24.0,
                                -0.5,
                                1.0};
  for (const double c : kSine) sine = sine * f2 + c;
  for (const double c : kCosine) cosine = cosine * f2 + c;
  sine *= f;
  const bool odd = q == 1.0 || q == 3.0;
  if (of.second) {
    const double value = odd ? cosine : sine;
    return radius * (q == 2.0 || q == 3.0 ? -value : value);
  }
  const double value = odd ? sine : cosine;
  return radius * (q == 1.0 || q == 2.0 ? -value : value);
}

}  // namespace merkel
