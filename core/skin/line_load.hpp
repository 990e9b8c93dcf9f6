#pragma once

#include "core/skin/stress.hpp"

namespace merkel {

/// A uniform normal load on the straight line from (x, −half_length) to (x, +half_length) on the
/// surface.
struct LineLoad {
  double x_mm = 0.0;
  double half_length_mm = 0.0;
  double force_per_length_mN_per_mm = 0.0;
};

/// Stress in an elastic half-space under a line load: the Cartesian form of Boussinesq's point load
/// (Johnson, Contact Mechanics, Eq. 3.20), integrated along the line in closed form. With X = x−x₀,
/// q² = X²+z² and, for either end, s the distance along the line to it and R = √(q²+s²), the
/// difference between both ends of
///   σx: −3zX²·I₅ + (1−2ν)·s/(R(R+z)),   σy: −z·s³/(q²R³) + (1−2ν)·[zs/(q²R) − s/(R(R+z))],
///   σz: −3z³·I₅,   τxy: zX/R³ − (1−2ν)·X/(R(R+z)),   τyz: z²/R³,   τzx: −3Xz²·I₅,
/// I₅ = s(2s²+3q²)/(3q⁴R³), times force per length over 2π.
/// \param z_mm  > 0.  Real-time: yes.
[[nodiscard]] CartesianStress line_load_stress(const LineLoad& load, double poisson_ratio,
                                               double x_mm, double y_mm, double z_mm) noexcept;

/// Downward displacement of the surface under a line load:
/// f/(πE*)·[asinh((L+y)/|X|) + asinh((L−y)/|X|)], L the half-length. Infinite on the line itself.
[[nodiscard]] double line_load_displacement_mm(const LineLoad& load, double reduced_modulus_kPa,
                                               double x_mm, double y_mm) noexcept;

}  // namespace merkel
