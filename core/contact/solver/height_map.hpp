#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace merkel {

/// A rectangle of square pixels.
struct PixelGrid {
  double pixel_mm = 0.0;
  std::size_t columns = 0;
  std::size_t rows = 0;

  [[nodiscard]] std::size_t pixels() const noexcept { return columns * rows; }
  /// Centre of a column or row, from the middle of the rectangle.
  [[nodiscard]] double x_mm(std::size_t column) const noexcept {
    return (static_cast<double>(column) - 0.5 * static_cast<double>(columns - 1)) * pixel_mm;
  }
  [[nodiscard]] double y_mm(std::size_t row) const noexcept {
    return (static_cast<double>(row) - 0.5 * static_cast<double>(rows - 1)) * pixel_mm;
  }
};

/// The surface of a rigid tip above its lowest point, seen from the skin, at the centres of pixels.
struct HeightMap {
  PixelGrid grid;
  std::vector<double> height_mm;  ///< infinite where there is no tip
  /// Part of the pixel that the tip covers, 0 to 1: below 1 at its rims.
  std::vector<double> coverage;
  /// Within a pixel at a rim, the pressure is not even. Known of all pixels or, if empty, of none:
  /// then the coverage decides.
  struct Rim {
    bool known = false;
    double compliance = 0.0;  ///< extra, in pixels over E*
    double x = 0.0;           ///< where the pressure acts, from the middle, in pixels
    double y = 0.0;
  };
  std::vector<Rim> rims = {};
};

/// The height of a tip above its lowest plane at a point of the tip, mm; infinite beyond the tip.
using TipHeight = std::function<double(double x_mm, double y_mm)>;

}  // namespace merkel
