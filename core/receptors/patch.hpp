#pragma once

#include <cstdint>

#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// A rectangle of skin and its grid of subregions, one afferent each. x runs from the fingertip
/// along the finger, y across it; both start at 0.
///
/// Afferents are numbered from 1 along x, then y: n = columns·⌊y/height⌋ + ⌊x/width⌋ + 1.
struct Patch {
  double length_mm = 30.0;  ///< along x
  double width_mm = 20.0;   ///< along y
  int columns = 5;          ///< subregions along x
  int rows = 4;             ///< subregions along y

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
  [[nodiscard]] int subregions() const noexcept { return columns * rows; }
  [[nodiscard]] double area_mm2() const noexcept { return length_mm * width_mm; }
  [[nodiscard]] bool contains(double x_mm, double y_mm) const noexcept;
  /// The afferent of the subregion that contains a point of the patch. The far edges belong to the
  /// last column and row.
  [[nodiscard]] std::uint32_t neuron_at(double x_mm, double y_mm) const noexcept;
  /// Centre of the subregion of an afferent, numbered from 1.
  [[nodiscard]] double centre_x_mm(std::uint32_t neuron) const noexcept;
  [[nodiscard]] double centre_y_mm(std::uint32_t neuron) const noexcept;
};

}  // namespace merkel
