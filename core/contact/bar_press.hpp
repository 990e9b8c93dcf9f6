#pragma once

#include <vector>

#include "core/contact/bar_contact.hpp"
#include "core/math/gauss_legendre.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

// Straight bars on a finger that is curved across with radius R. They touch over a length that
// grows with the depth d, L = min(bar length, 2·√(1.65·R·d)). A press is the sum of its increments,
// each of which acts as flat bars of the current length. The factor 1.65 comes from an independent
// boundary element solution (core/README.md lists the errors). The curvature along the finger,
// across the bars, is neglected; on flat skin the bars touch over their whole length. Real-time:
// no.

/// The part of the bars that touches at a depth.
[[nodiscard]] BarTip touching_part(BarTip tip, double skin_radius_mm, double depth_mm);
/// The depth from which the bars touch over their whole length.
[[nodiscard]] double whole_length_depth_mm(const BarTip& tip, double skin_radius_mm);
/// The depths at which a press from one depth to another is evaluated, and their weights:
/// Gauss-Legendre in √d.
[[nodiscard]] std::vector<QuadratureNode> press_increments(double from_mm, double to_mm, int count);

/// The line loads under bars at a depth, on flat skin or on a curved finger, where they include all
/// increments of the press.
/// \param finest_mm  as in BarContact::solve
[[nodiscard]] BarContact loads_under_bars(const BarTip& tip, const SkinParameters& skin,
                                          double depth_mm, double finest_mm);

}  // namespace merkel
