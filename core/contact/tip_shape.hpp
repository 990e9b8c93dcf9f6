#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/contact/solver/rigid_contact.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/parameters/position.hpp"

namespace merkel {

/// A rigid pin with a flat round end, as in most recordings of single afferents.
struct PinTip {
  double diameter_mm = 1.0;  ///< also of a dot, and of the base of a cone

  [[nodiscard]] static FieldTable fields();
  friend bool operator==(const PinTip&, const PinTip&) = default;
};

/// A row of rigid flat-ended bars that move together, as in the gratings of Phillips & Johnson
/// (1981). The bars lie side by side along x, have the same length along y, and end at the same
/// height.
struct BarTip {
  std::vector<double> widths_mm{5.0, 5.0, 5.0};  ///< along x
  std::vector<double> gaps_mm{3.0, 5.0};         ///< between neighbours; one fewer than widths
  double length_mm = 20.0;                       ///< along y

  static constexpr std::size_t kMostBars = 40;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
  /// Distance from the first bar's outer edge to the last bar's.
  [[nodiscard]] double total_width_mm() const noexcept;
  /// x of a bar's centre, relative to the middle of the row.
  [[nodiscard]] double centre_mm(std::size_t bar) const noexcept;
  friend bool operator==(const BarTip&, const BarTip&) = default;
};

/// What edges, wedges, cones, cylinders, dots and measured shapes add to the keys of pins and bars.
struct TipShape {
  double width_mm = 0.5;        ///< of an edge, and of the base of a wedge, along x
  double length_mm = 5.0;       ///< of an edge, wedge or cylinder, along y
  double angle_deg = 90.0;      ///< between the faces of a wedge or cone
  std::vector<Position> dots;   ///< centres of dots
  double edge_radius_mm = 0.0;  ///< of all rims, ridges and apices
  double orientation_deg = 0.0;
  double tilt_deg = 0.0;
  std::string file;                      ///< with the heights of a measured shape
  double pixel_mm = 0.0;                 ///< of the file; 0: not set
  std::shared_ptr<const HeightMap> map;  ///< read from the file

  static constexpr std::size_t kMostDots = 200;

  [[nodiscard]] static FieldTable fields();
  friend bool operator==(const TipShape&, const TipShape&) = default;
};

/// What makes a tip a surface that slides under the finger.
struct SlidingSurface {
  bool slides = false;
  double relief_mm = std::numeric_limits<double>::infinity();  ///< of its parts above a base plate
  double period_x_mm = 0.0;                                    ///< 0: does not repeat
  double period_y_mm = 0.0;
  double deepest_mm = 1.2;  ///< for which the contact has room

  [[nodiscard]] static FieldTable fields();
  friend bool operator==(const SlidingSurface&, const SlidingSurface&) = default;
};

}  // namespace merkel
