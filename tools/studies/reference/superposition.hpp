#pragma once

#include <functional>

namespace merkel::reference {

/// ∫ f over [a, b] by the tanh-sinh rule, which handles singularities at the ends. Doubles the
/// number of points until two results agree within `tolerance`, relative to the integral of |f|.
double integrate(const std::function<double(double)>& f, double a, double b,
                 double tolerance = 1e-13);

/// σr, σθ, σz, τrz at (r, z), kPa, tension positive.
struct Stress {
  double r = 0.0;
  double theta = 0.0;
  double z = 0.0;
  double rz = 0.0;
};

/// The stress under the pressure p0·√(1−r²/a²) on a disc, by brute force: the integral of
/// Boussinesq point loads over the disc, in polar coordinates about the projection of the point.
/// \param tolerance  relative tolerance of the integrals
Stress superposed_stress(double p0_kPa, double a_mm, double poisson_ratio, double r_mm, double z_mm,
                         double tolerance = 1e-13);

/// Downward displacement of the surface at r under the same pressure, by the same method:
/// u = ∬ p/(πE*·distance) dA.
double superposed_displacement_mm(double p0_kPa, double a_mm, double reduced_modulus_kPa,
                                  double r_mm);

}  // namespace merkel::reference
