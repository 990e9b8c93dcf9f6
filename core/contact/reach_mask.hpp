#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/contact/solver/height_map.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// Where a press can be felt: the depth below which a press reaches each cell around a tip's axis
/// is reached.
struct ReachMask {
  PixelGrid cells;
  std::vector<float> depth_mm;  ///< beyond the deepest: by all presses

  /// Whether a press reaches a rectangle, given from the axis; true if it is not all inside.
  /// Real-time: yes.
  [[nodiscard]] bool reaches(double press_depth_mm, double left, double right, double bottom,
                             double top) const noexcept MERKEL_REALTIME {
    const auto place = [this](double at_mm, std::size_t count) {
      return std::floor(at_mm / cells.pixel_mm + 0.5 * static_cast<double>(count));
    };
    const double first_x = place(left, cells.columns);
    const double last_x = place(right, cells.columns);
    const double first_y = place(bottom, cells.rows);
    const double last_y = place(top, cells.rows);
    if (!(first_x >= 0.0 && first_y >= 0.0 && last_x < static_cast<double>(cells.columns) &&
          last_y < static_cast<double>(cells.rows))) {
      return true;
    }
    for (auto j = static_cast<std::size_t>(first_y); j <= static_cast<std::size_t>(last_y); ++j) {
      for (auto i = static_cast<std::size_t>(first_x); i <= static_cast<std::size_t>(last_x); ++i) {
        if (static_cast<double>(depth_mm[j * cells.columns + i]) < press_depth_mm) return true;
      }
    }
    return false;
  }
};

}  // namespace merkel
