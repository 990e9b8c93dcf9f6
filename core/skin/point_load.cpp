#include "core/skin/point_load.hpp"

#include <cassert>
#include <cmath>
#include <numbers>

namespace merkel {

AxisymmetricStress point_load_stress(double force_mN, double poisson_ratio, double r_mm,
                                     double z_mm) noexcept {
  const double rho = std::hypot(r_mm, z_mm);
  assert(rho > 0.0 && z_mm >= 0.0);
  const double rho3 = rho * rho * rho;
  const double rho5 = rho3 * rho * rho;
  const double scale = force_mN / (2.0 * std::numbers::pi);
  const double lateral = (1.0 - 2.0 * poisson_ratio) / (rho * (rho + z_mm));
  return {.sigma_r = scale * (lateral - 3.0 * z_mm * r_mm * r_mm / rho5),
          .sigma_theta = -scale * (lateral - (1.0 - 2.0 * poisson_ratio) * z_mm / rho3),
          .sigma_z = -scale * 3.0 * z_mm * z_mm * z_mm / rho5,
          .tau_rz = -scale * 3.0 * r_mm * z_mm * z_mm / rho5};
}

}  // namespace merkel
