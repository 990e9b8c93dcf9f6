#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/parameters/position.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// A tactile array: sensing elements (taxels) of equal size, each of which measures the mean
/// pressure on its area. Its pressures press on the skin as measured: there is no contact law.
struct TaxelArray {
  static constexpr std::string_view kName = "taxels";
  enum class Shape : std::uint8_t { kRectangle, kDisc };
  static constexpr std::size_t kMax = 1024;
  /// Different x of the taxels, on which the cost of a tick depends.
  static constexpr std::size_t kMaxColumns = 64;

  int columns = 0;  ///< of a lattice, along x
  int rows = 0;     ///< along y
  double pitch_mm = 1.0;
  /// Centres of the taxels from the array's middle, instead of a lattice.
  std::vector<Position> listed;
  Shape shape = Shape::kRectangle;
  double width_mm = 1.0;   ///< along x; the diameter of a disc
  double length_mm = 1.0;  ///< along y, of a rectangle
  double least_kPa = 0.0;  ///< smaller pressures are 0
  Position place;          ///< of the array's middle on the patch: the probe's x_mm, y_mm

  [[nodiscard]] std::size_t size() const noexcept;
  /// In the order of the device's channels: of a lattice, along x first.
  [[nodiscard]] std::vector<Position> centres() const;
  [[nodiscard]] double area_mm2() const noexcept;

  [[nodiscard]] static FieldTable fields();
  void check(const SkinParameters& skin, ParameterCheck& all) const;
  friend bool operator==(const TaxelArray&, const TaxelArray&) = default;
};

}  // namespace merkel
