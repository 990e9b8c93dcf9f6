#pragma once

#include <vector>

#include "core/contact/solver/height_map.hpp"
#include "core/parameters/position.hpp"

namespace merkel {

// Tips around the origin. `edge_radius_mm` rounds the rims of flat ends, the ridge of a wedge and
// the apex of a cone; 0 leaves them sharp.

/// A paraboloid with the sphere's curvature, as in Hertz contact.
[[nodiscard]] TipHeight sphere_height(double radius_mm);
/// The sphere itself, which ends at its equator.
[[nodiscard]] TipHeight exact_sphere_height(double radius_mm);
[[nodiscard]] TipHeight pin_height(double diameter_mm, double edge_radius_mm);
struct FlatRectangle {
  double x_mm, y_mm;           ///< of its centre
  double width_mm, length_mm;  ///< along x and y
};
[[nodiscard]] TipHeight rectangles_height(std::vector<FlatRectangle> ends, double edge_radius_mm);
/// Flat round ends side by side.
[[nodiscard]] TipHeight dots_height(std::vector<Position> centres, double diameter_mm,
                                    double edge_radius_mm);
/// A ridge along y. \param angle_deg  between its two faces
[[nodiscard]] TipHeight wedge_height(double width_mm, double length_mm, double angle_deg,
                                     double edge_radius_mm);
[[nodiscard]] TipHeight cone_height(double diameter_mm, double angle_deg, double edge_radius_mm);
/// A cylinder that lies along y, as a parabola.
[[nodiscard]] TipHeight cylinder_height(double radius_mm, double length_mm);
/// A height map, interpolated linearly between the centres of its pixels; where they differ by more
/// than four pixels, or one has no tip, a wall stands at the border between them.
[[nodiscard]] TipHeight map_height(const HeightMap& map);

/// The tip turned counterclockwise by `orientation_deg`, then tilted so that it rises by tan(tilt)
/// along x.
[[nodiscard]] TipHeight turned(TipHeight tip, double orientation_deg, double tilt_deg);
/// The gap between a tip and a finger that curves away from the origin, x²/2R_along + y²/2R_across,
/// with its apex at `apex` from the tip: the finger's slope there adds x·X/R.
[[nodiscard]] TipHeight above_finger(TipHeight tip, double radius_along_mm, double radius_across_mm,
                                     const Position& apex);

/// A pixel in which the tip rises by more than this many pixels is at a rim.
inline constexpr double kRimRise = 4.0;

/// Samples a tip at the pixels of a grid. At a rim, the height is that of the lower part, and the
/// coverage the part of the pixel that it covers.
[[nodiscard]] HeightMap height_map(const TipHeight& tip, const PixelGrid& grid);

}  // namespace merkel
