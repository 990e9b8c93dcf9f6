#include "core/contact/huber_stress.hpp"

#include <cassert>
#include <cmath>

namespace merkel {

AxisymmetricStress huber_stress(const ContactState& contact, double poisson_ratio, double r_mm,
                                double z_mm) noexcept {
  assert(r_mm >= 0.0 && z_mm >= 0.0);
  if (!contact.touching()) return {};
  const double a = contact.contact_radius_mm;
  const double p0 = contact.peak_pressure_kPa;
  const double nu = poisson_ratio;
  const double a2 = a * a;

  const double B = (r_mm - a) * (r_mm + a) + z_mm * z_mm;
  const double D = std::hypot(B, 2.0 * a * z_mm);
  double s = 0.0;
  double u = 0.0;
  if (B <= 0.0) {
    const double w = 0.5 * (D - B);
    s = std::sqrt(w) / a;
    u = w > 0.0 ? a2 * z_mm * z_mm / w : 0.0;
  } else {
    u = 0.5 * (B + D);
    s = z_mm / std::sqrt(u);
  }
  const double root_u = std::sqrt(u);
  const double t = root_u / a * std::atan2(a, root_u);
  const double A = (1.0 - 2.0 * nu) / 3.0 * a2 * (1.0 + s + s * s) / ((1.0 + s) * (a2 + u));
  const double s2_over_D = D > 0.0 ? s * s * a2 / D : 0.0;
  const double u_part = (1.0 - nu) * u / (a2 + u);

  return {.sigma_r = p0 * (A + s * s2_over_D + s * (u_part + (1.0 + nu) * t - 2.0)),
          .sigma_theta = -p0 * (A + s * (2.0 * nu + u_part - (1.0 + nu) * t)),
          .sigma_z = -p0 * s * s2_over_D,
          .tau_rz = -p0 * r_mm * s2_over_D * root_u / (a2 + u)};
}

}  // namespace merkel
