#pragma once

#include <cstddef>
#include <vector>

#include "core/contact/kernel/grid_interpolation.hpp"
#include "core/contact/solver/contact_pixels.hpp"
#include "core/contact/solver/layered_medium.hpp"

namespace merkel {

/// The fields of a press at several depths, per mm of depth; the first has no depth and no field.
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
  ContactPixels contact;             ///< in which the deepest table is solved
  std::vector<double> pressure_kPa;  ///< of that table
  std::size_t solutions = 0;
  double error = 0.0;  ///< largest of the solutions, see RigidContact::Solution
};

/// Solves the contact and computes stresses and displacements at receptor depth on nodes a sixth of
/// it apart, over the contact and a margin around it of at least 6 mm, and 10 mm at most, where
/// that takes no larger transforms. Depths are added until, half-way between two of them in √d,
/// force and stress are those of the solution there to 0.5 and 1 %, from 0.02 mm on. Real-time: no.
[[nodiscard]] PressTables press_tables(const PressedTip& tip, const LayeredMedium& medium,
                                       double receptor_depth_mm);

}  // namespace merkel
