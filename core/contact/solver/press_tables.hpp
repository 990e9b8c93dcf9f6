#pragma once

#include <cstddef>
#include <vector>

#include "core/contact/kernel/grid_interpolation.hpp"
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
};

/// The fields of a press at depths (k/last)²·deepest, per mm of depth; the first is empty.
struct PressTables {
  struct Table {
    double depth_mm = 0.0;
    double force_mN_per_mm = 0.0;
    std::vector<GridNode> nodes;
  };
  PixelGrid grid;  ///< of the nodes, around the tip's origin
  std::vector<Table> tables;
};

/// The pixels of a tip's contact: six across its smallest feature, eight per receptor depth, fewer
/// where that would be more than 2^16 in all.
[[nodiscard]] PixelGrid contact_pixels(const PressedTip& tip, double receptor_depth_mm);

/// Solves the contact at `count` depths and computes stresses and displacements.
/// Real-time: no.
[[nodiscard]] PressTables press_tables(const PressedTip& tip, const LayeredMedium& medium,
                                       double receptor_depth_mm, double deepest_mm,
                                       std::size_t count, double margin_mm);

}  // namespace merkel
