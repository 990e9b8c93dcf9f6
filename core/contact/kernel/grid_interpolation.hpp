#pragma once

#include <array>
#include <cstddef>

#include "core/skin/stress.hpp"

namespace merkel {

/// The values at a node of a grid: seven and a zero, so that a node is a whole number of vectors.
struct alignas(32) GridNode {
  static constexpr std::size_t kFields = 7;
  std::array<float, 8> values{};

  /// Of a node whose first six values are stresses.
  [[nodiscard]] CartesianStress stress() const noexcept {
    const auto value = [&](std::size_t field) { return static_cast<double>(values[field]); };
    return {.sigma_x = value(0),
            .sigma_y = value(1),
            .sigma_z = value(2),
            .tau_xy = value(3),
            .tau_yz = value(4),
            .tau_zx = value(5)};
  }
};

/// A node and the 15 around it that a cubic interpolation in two directions needs, in two tables.
struct GridPatch {
  const GridNode* corner[2] =
      {};                   ///< of lowest index, in each table; a null second one is not used
  std::size_t columns = 0;  ///< of the grid: distance between two rows of nodes
  std::array<double, 4> along_x{};
  std::array<double, 4> along_y{};
  double weight[2] = {};  ///< of each table
};

/// The weighted sum of two tables' interpolated values. Bit-identical on every instruction set.
/// Real-time: yes.
[[nodiscard]] GridNode interpolate(const GridPatch& patch) noexcept;

/// Three values at a node of a grid, and a zero.
struct alignas(16) EnergyNode {
  std::array<float, 4> values{};
};

/// Points between the nodes of a grid, in columns and rows from its first node: at least one node
/// from its rim, and less than two from its far one.
struct GridPoints {
  static constexpr std::size_t kCount = 16;
  std::array<double, kCount> column;
  std::array<double, kCount> row;
};

/// The cubically interpolated values at some points. Bit-identical on every instruction set.
/// Real-time: yes.
/// \param columns  of the grid
void interpolate(const EnergyNode* nodes, std::size_t columns, const GridPoints& points,
                 std::array<EnergyNode, GridPoints::kCount>& totals) noexcept;

}  // namespace merkel
