#pragma once

#include "core/skin/stress.hpp"

namespace merkel {

/// Stress in an elastic half-space under a normal point load at the origin (Boussinesq 1885;
/// Johnson, Contact Mechanics, Eq. 3.19); ρ² = r²+z²:
/// σr = P/2π·[(1−2ν)/(ρ(ρ+z)) − 3zr²/ρ⁵]; σθ = −P/2π·(1−2ν)·[1/(ρ(ρ+z)) − z/ρ³];
/// σz = −3Pz³/(2πρ⁵); τrz = −3Prz²/(2πρ⁵).
/// \param force_mN  P, directed into the half-space;  r_mm ≥ 0, z_mm ≥ 0, not both 0
/// Real-time: yes.
[[nodiscard]] AxisymmetricStress point_load_stress(double force_mN, double poisson_ratio,
                                                   double r_mm, double z_mm) noexcept;

}  // namespace merkel
