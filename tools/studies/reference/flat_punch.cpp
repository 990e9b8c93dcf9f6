#include "tools/studies/reference/flat_punch.hpp"

#include <cassert>
#include <cmath>
#include <complex>
#include <numbers>

namespace merkel::reference {

AxisymmetricStress flat_punch_stress(double force_mN, double a, double nu, double r, double z) {
  assert(z > 0.0);
  using Complex = std::complex<double>;
  const Complex c(z, a);
  // √(r²+c²) with a positive real part.
  const double real = r * r + z * z - a * a;
  const double imaginary = 2.0 * a * z;
  const double size = std::sqrt(real * real + imaginary * imaginary);
  const double root =
      real > 0.0 ? std::sqrt(0.5 * (size + real)) : imaginary / std::sqrt(2.0 * (size - real));
  const Complex R(root, 0.5 * imaginary / root);
  const Complex sum = R + c;
  const Complex z_1 = 1.0 / R;                   // ψ_z
  const Complex zz = -c / (R * R * R);           // ψ_zz
  const Complex r_over_r = 1.0 / (R * sum);      // ψ_r/r
  const Complex rz_over_r = -1.0 / (R * R * R);  // ψ_rz/r
  const Complex rr = -zz - r_over_r;             // ψ_rr, as ψ is harmonic
  const Complex first_r_over_r = -1.0 / sum;     // ψ1_r/r
  const Complex first_rr = -z_1 - first_r_over_r;
  const double scale = force_mN / (2.0 * std::numbers::pi * a);
  const double sigma_r = 2.0 * nu * z_1.imag() - z * rr.imag() - (1.0 - 2.0 * nu) * first_rr.imag();
  const double sigma_theta =
      2.0 * nu * z_1.imag() - z * r_over_r.imag() - (1.0 - 2.0 * nu) * first_r_over_r.imag();
  return {.sigma_r = scale * sigma_r,
          .sigma_theta = scale * sigma_theta,
          .sigma_z = scale * (z_1.imag() - z * zz.imag()),
          .tau_rz = -scale * z * r * rz_over_r.imag()};
}

}  // namespace merkel::reference
