#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "core/contact/kernel/grid_interpolation.hpp"
#include "core/contact/solver/hertz_ellipse.hpp"
#include "core/contact/solver/layered_medium.hpp"
#include "core/contact/solver/rigid_contact.hpp"
#include "core/contact/solver/tip_heights.hpp"

namespace merkel {

/// A tip to be pressed into a finger, and what its tables must resolve.
struct PressedTip {
  TipHeight gap;                ///< between the tip and the undeformed skin
  double half_width_mm = 0.0;   ///< of the largest contact along x
  double half_length_mm = 0.0;  ///< along y
  double feature_mm = 0.0;      ///< the smallest part of the tip that must be resolved
  double deepest_mm = 1.0;      ///< of the tables
  bool proportional = false;    ///< to the depth: a flat end on flat skin
  /// Of a flat end; pixels at its rim count as a whole, so that their sum is larger.
  double largest_area_mm2 = std::numeric_limits<double>::infinity();
  std::optional<HertzEllipse> ellipse;  ///< the contact, where it is known
};

/// The fields of a press at depths (k/last)²·deepest, per mm of depth; the first is empty. Those of
/// an ellipse, which needs no solution, are closer when shallow: (k/last)^2.5.
struct PressTables {
  struct Table {
    double depth_mm = 0.0;
    double force_mN_per_mm = 0.0;
    double area_mm2 = 0.0;           ///< of the contact
    double peak_pressure_kPa = 0.0;  ///< of a pixel: at a sharp rim, it depends on its size
    std::vector<GridNode> nodes;
  };
  PixelGrid grid;  ///< of the nodes, around the tip's axis
  std::vector<Table> tables;
  PixelGrid contact;                 ///< in which the contact is solved
  std::vector<double> pressure_kPa;  ///< at the deepest table
  int iterations = 0;                ///< of all solutions
  double error = 0.0;                ///< largest of the solutions, see RigidContact::Solution
};

/// The pixels of a tip's contact: twelve across its smallest feature, six per receptor depth, fewer
/// where that would be more than 2^16 in all.
[[nodiscard]] PixelGrid contact_pixels(const PressedTip& tip, double receptor_depth_mm);

/// Solves the contact at `count` depths and computes stresses and displacements on the contact and
/// a margin around it of at least 6 mm, and 10 mm at most, where that takes no larger transforms.
/// Real-time: no.
[[nodiscard]] PressTables press_tables(const PressedTip& tip, const LayeredMedium& medium,
                                       double receptor_depth_mm, std::size_t count);

}  // namespace merkel
