#pragma once

#include <cmath>

#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// 1/(1+e^−x). Branches on the sign of x, so that large |x| saturates without overflow. Real-time:
/// yes.
template <class Real>
[[nodiscard]] Real logistic(Real x) noexcept {
  if (x < Real(0)) {
    const Real e = std::exp(x);
    return e / (Real(1) + e);
  }
  return Real(1) / (Real(1) + std::exp(-x));
}

/// The current of a receptor as a function of its strain energy density (Eq. 7, 10):
/// I = α/(1+exp(γ(λ−SED))) if the skin's surface is displaced by at least the threshold, else 0.
struct SigmoidTransduction {
  double alpha_uA_per_cm2 = 1.0;  ///< α, saturation current of one receptor
  double lambda_kPa = 0.10;       ///< λ, energy density at half saturation
  double gamma_per_kPa = 50.0;    ///< γ, slope
  double threshold_um = 5.0;      ///< smallest surface displacement at the receptor

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;

  /// The sigmoid without the threshold. Real-time: yes.
  [[nodiscard]] double current_uA_per_cm2(double energy_density_kPa) const noexcept
      MERKEL_REALTIME {
    return alpha_uA_per_cm2 * logistic(gamma_per_kPa * (energy_density_kPa - lambda_kPa));
  }
};

}  // namespace merkel
