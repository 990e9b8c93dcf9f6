#pragma once

#include <limits>
#include <optional>

#include "core/contact/solver/height_map.hpp"
#include "core/contact/solver/hertz_ellipse.hpp"
#include "core/parameters/position.hpp"

namespace merkel {

/// A tip to be pressed into a finger, and what its tables must resolve.
struct PressedTip {
  TipHeight gap;                ///< between the tip and the undeformed skin, from its lowest point
  double half_width_mm = 0.0;   ///< of the largest contact along x
  double half_length_mm = 0.0;  ///< along y
  double feature_mm = std::numeric_limits<double>::infinity();  ///< smallest part to be resolved
  double pixel_mm = std::numeric_limits<double>::infinity();    ///< of a measured shape
  double deepest_mm = 1.0;                                      ///< of the tables
  bool proportional = false;            ///< to the depth: a flat end on flat skin
  std::optional<HertzEllipse> ellipse;  ///< the contact, where it is known
};

/// The pixels of a contact, and where their middle lies, from the tip's axis.
struct ContactPixels {
  PixelGrid grid;
  Position middle;
};

/// The pixels in which a press to a depth is solved: of the part of the tip that can touch, as fine
/// as that part, the tip's smallest feature and a measured shape need, and, under rims, a sixth of
/// the receptors' depth, but at most 2^16.
[[nodiscard]] ContactPixels contact_pixels(const PressedTip& tip, double depth_mm,
                                           double receptor_depth_mm);

/// Pixels, or nodes, on both sides of a middle, so that they cover a half width: an odd number.
[[nodiscard]] std::size_t pixels_over(double half_mm, double pixel_mm) noexcept;

/// The pixel of which kMaxPixels cover a rectangle of these half sides, which is at least three
/// pixels wide: a finer one is too fine.
[[nodiscard]] double finest_pixel_mm(double half_width_mm, double half_length_mm) noexcept;

/// Most pixels of a contact, fewest nodes per receptor depth, and the largest pixel, in depths of
/// the receptors.
inline constexpr double kMaxPixels = 65536.0;
inline constexpr double kNodesPerDepth = 6.0;
inline constexpr double kCoarsestPixel = 0.5;

}  // namespace merkel
