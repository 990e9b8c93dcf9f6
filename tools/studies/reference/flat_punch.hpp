#pragma once

#include "core/skin/stress.hpp"

namespace merkel::reference {

// A rigid flat round punch on an elastic half-space, in closed form.

/// Stress under the pressure P/(2πa√(a²−r²)) of a punch of radius a.
///
/// With c = z + i·a, R = √(r²+c²): ψ = P/a·Im ln(R+c) is the potential of the pressure, and
/// ψ1 = P/a·Im(c·ln(R+c) − R) its integral over z, for which (Johnson, Contact Mechanics, section
/// 3.2) σz = [ψ_z − z·ψ_zz]/2π, τrz = −z·ψ_rz/2π, σr = [2ν·ψ_z − z·ψ_rr − (1−2ν)·ψ1_rr]/2π,
/// σθ = [2ν·ψ_z − z·ψ_r/r − (1−2ν)·ψ1_r/r]/2π.
/// \param z_mm  > 0: on the surface, the stress at the rim is infinite.
[[nodiscard]] AxisymmetricStress flat_punch_stress(double force_mN, double radius_mm,
                                                   double poisson_ratio, double r_mm, double z_mm);

}  // namespace merkel::reference
