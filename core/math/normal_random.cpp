#include "core/math/normal_random.hpp"

#include <bit>
#include <cmath>
#include <numbers>
#include <span>

#include "core/math/random.hpp"

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
  const auto horner = [f2](std::span<const double> series) {
    double sum = series[0];
    for (const double c : series.subspan(1)) sum = sum * f2 + c;
    return sum;
  };
  const double sine = f * horner(kSineSeries);
  const double cosine = horner(kCosineSeries);
  const bool odd = q == 1.0 || q == 3.0;
  if (of.second) {
    const double value = odd ? cosine : sine;
    return radius * (q == 2.0 || q == 3.0 ? -value : value);
  }
  const double value = odd ? sine : cosine;
  return radius * (q == 1.0 || q == 2.0 ? -value : value);
}

}  // namespace merkel
