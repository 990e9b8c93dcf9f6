#include "core/receptors/receptor_density.hpp"

#include <cmath>
#include <numbers>

#include "core/math/portable_math.hpp"

namespace merkel {
namespace {

using std::numbers::pi;
using std::numbers::sqrt2;

/// Bisects [low, high] until no double lies between; `below(x)` returns whether the root is above
/// x.
template <class Below>
double bisect(double low, double high, Below below) {
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (!(middle > low && middle < high)) return low;
    (below(middle) ? low : high) = middle;
  }
}

}  // namespace

Expected<ReceptorDensity, ParameterError> ReceptorDensity::create(const Parameters& p) {
  const auto checked =
      ParameterCheck()
          .number("receptors.length_mm", p.length_mm, positive(1e9))
          .number("receptors.density_per_mm2", p.mean_per_mm2, positive(1e9))
          .number("receptors.density_min_per_mm2", p.min_per_mm2, not_negative(1e9))
          .number("receptors.density_max_per_mm2", p.max_per_mm2, positive(1e9))
          .require(
              p.min_per_mm2 < p.mean_per_mm2 && p.mean_per_mm2 < p.max_per_mm2,
              "receptors.density_per_mm2",
              "must lie between density_min_per_mm2 and density_max_per_mm2: scale all three by one "
              "factor, or set the number itself, receptors.count")
          .result();
  if (!checked) return Unexpected<ParameterError>(checked.error());

  // The mean over [0, l], relative to the range from d_min to d_max, is g(l/(σ√2)) with
  // g(q) = √π·erf(q)/(2q), which falls from 1 at q = 0 to 0.
  const double fraction = (p.mean_per_mm2 - p.min_per_mm2) / (p.max_per_mm2 - p.min_per_mm2);
  const double q = bisect(0.0, 1.0 / fraction, [fraction](double x) {
    return std::sqrt(pi) * portable_erf(x) > 2.0 * x * fraction;
  });
  const double sigma = p.length_mm / (q * sqrt2);
  const double alpha = (p.max_per_mm2 - p.min_per_mm2) * sigma * std::sqrt(2.0 * pi);
  return ReceptorDensity(alpha, p.min_per_mm2, sigma, p.length_mm);
}

ReceptorDensity::ReceptorDensity(double alpha, double beta, double sigma_mm,
                                 double length_mm) noexcept
    : alpha_(alpha), beta_(beta), sigma_mm_(sigma_mm), length_mm_(length_mm) {}

double ReceptorDensity::density_per_mm2(double x_mm) const noexcept {
  const double q = x_mm / sigma_mm_;
  return alpha_ / (sigma_mm_ * std::sqrt(2.0 * pi)) * portable_exp(-0.5 * q * q) + beta_;
}

double ReceptorDensity::cumulative_per_mm(double x_mm) const noexcept {
  return 0.5 * alpha_ * portable_erf(x_mm / (sigma_mm_ * sqrt2)) + beta_ * x_mm;
}

double ReceptorDensity::quantile_mm(double fraction) const noexcept {
  // Newton's iteration, kept inside a shrinking bracket; f > 0, so F is strictly rising.
  const double target = fraction * cumulative_per_mm(length_mm_);
  double low = 0.0;
  double high = length_mm_;
  double x = fraction * length_mm_;
  for (int iteration = 0; iteration < 100; ++iteration) {
    const double excess = cumulative_per_mm(x) - target;
    (excess > 0.0 ? high : low) = x;
    double next = x - excess / density_per_mm2(x);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::fabs(next - x) <= 1e-15 * length_mm_) return next;
    x = next;
  }
  return x;
}

}  // namespace merkel
