#pragma once

#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// A rigid pin with a flat round end, as in most recordings of single afferents. The closed forms
/// below are for flat skin; FlatTipField handles a curved finger.
struct PinTip {
  double diameter_mm = 1.0;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// F/d of a pin: 2aE* (Johnson, Contact Mechanics, Eq. 3.36).
[[nodiscard]] double pin_force_mN_per_mm(const PinTip& pin, double reduced_modulus_kPa) noexcept;

/// Stress in an elastic half-space under the pressure P/(2πa√(a²−r²)) of a pin of radius a.
///
/// With c = z + i·a, R = √(r²+c²): ψ = P/a·Im ln(R+c) is the potential of the pressure, and
/// ψ1 = P/a·Im(c·ln(R+c) − R) its integral over z, for which (Johnson, section 3.2)
/// σz = [ψ_z − z·ψ_zz]/2π, τrz = −z·ψ_rz/2π, σr = [2ν·ψ_z − z·ψ_rr − (1−2ν)·ψ1_rr]/2π,
/// σθ = [2ν·ψ_z − z·ψ_r/r − (1−2ν)·ψ1_r/r]/2π.
/// \param r_mm  ≥ 0
/// \param z_mm  > 0: on the surface, the stress at the rim is infinite.
/// Real-time: yes.
[[nodiscard]] AxisymmetricStress pin_stress(double force_mN, double radius_mm, double poisson_ratio,
                                            double r_mm, double z_mm) noexcept MERKEL_REALTIME;

/// Downward displacement of the surface: d inside, d·(2/π)·asin(a/r) outside.
[[nodiscard]] double pin_displacement_mm(double depth_mm, double radius_mm, double r_mm) noexcept;

}  // namespace merkel
