#pragma once

#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// Receptor density along the finger (Eq. 8): f(x) = α/(σ√2π)·exp(−x²/2σ²) + β per mm².
///
/// α, β and σ follow from three conditions: f(0) = d_max, f(∞) = d_min, and a mean of d over the
/// patch's length l. With the paper's d = 0.75, d_max = 1.29, d_min = 0.143 and l = 30 mm:
/// α = 37.17592397, β = 0.143, σ = 12.93029458.
class ReceptorDensity {
 public:
  struct Parameters {
    double mean_per_mm2 = 0.75;  ///< d
    double max_per_mm2 = 1.29;   ///< d_max, at the fingertip
    double min_per_mm2 = 0.143;  ///< d_min, far from it
    double length_mm = 30.0;     ///< l
  };

  /// Fails unless 0 ≤ d_min < d < d_max and l > 0. Bisection on σ to the last bit.
  [[nodiscard]] static Expected<ReceptorDensity, ParameterError> create(
      const Parameters& parameters);

  [[nodiscard]] double sigma_mm() const noexcept { return sigma_mm_; }

  /// f(x), per mm².
  [[nodiscard]] double density_per_mm2(double x_mm) const noexcept;
  /// F(x) = ∫₀ˣ f = α/2·erf(x/σ√2) + βx, per mm of width.
  [[nodiscard]] double cumulative_per_mm(double x_mm) const noexcept;
  /// F⁻¹: the x in [0, l] such that a given fraction of the receptors lies nearer the fingertip.
  [[nodiscard]] double quantile_mm(double fraction) const noexcept;

 private:
  ReceptorDensity(double alpha, double beta, double sigma_mm, double length_mm) noexcept;

  double alpha_;
  double beta_;
  double sigma_mm_;
  double length_mm_;
};

}  // namespace merkel
