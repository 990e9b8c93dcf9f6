#pragma once

#include "core/realtime_tag.hpp"
#include "core/records/contact_state.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Stress in an elastic half-space under the pressure p0·√(1−r²/a²) of a sphere (Eq. 4, 5).
///
/// Closed form of Huber, Annalen der Physik 319 (1904) 153, rearranged to avoid cancellation and
/// singularities on the axis (r = 0) and the surface (z = 0):
/// B = r²+z²−a², D = √(B²+4a²z²);
/// B ≤ 0: w = (D−B)/2, s = √w/a, u = a²z²/w;   B > 0: u = (B+D)/2, s = z/√u;
/// t = (√u/a)·atan2(a, √u); A = (1−2ν)/3·a²(1+s+s²)/((1+s)(a²+u));
/// σr = p0{A + s³a²/D + s[(1−ν)u/(a²+u) + (1+ν)t − 2]};
/// σθ = −p0{A + s[2ν + (1−ν)u/(a²+u) − (1+ν)t]};
/// σz = −p0·s³a²/D;   τrz = −p0·r·a²s²√u/(D(a²+u)).
/// On the rim (r = a, z = 0), D = 0 and the terms divided by D take their limit, 0.
///
/// \param r_mm  distance from the axis, ≥ 0
/// \param z_mm  depth below the surface, ≥ 0
/// Real-time: yes.
[[nodiscard]] AxisymmetricStress huber_stress(const ContactState& contact, double poisson_ratio,
                                              double r_mm, double z_mm) noexcept MERKEL_REALTIME;

}  // namespace merkel
