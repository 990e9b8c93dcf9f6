#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace merkel {

/// Rows of a matrix product that are computed together.
inline constexpr std::size_t kProductRows = 8;
/// Columns of its factors are padded to a multiple of this number.
inline constexpr std::size_t kProductColumns = 16;

/// Some terms of a matrix product: out[q][j] = Σ_k factors[terms[k]][q]·rows[terms[k]][j].
struct ProductBlock {
  const float* factors = nullptr;  ///< [term][kProductRows]
  const float* rows = nullptr;     ///< [term][columns], aligned
  std::span<const std::uint32_t> terms;
  std::size_t columns = 0;  ///< a multiple of kProductColumns
  float* out = nullptr;     ///< [kProductRows][columns], aligned
};

/// Stresses at the nodes of a grid, and factors of their energy density.
struct NodeStresses {
  const float* of[6] = {};    ///< σx, σy, σz, τxy, τyz, τzx
  float distortional = 0.0F;  ///< 1/(12G)
  float volumetric = 0.0F;    ///< 1/(18K), or 0
};

/// A point within a grid, and the weights of the 16 nodes around it.
struct GridPoint {
  std::size_t first = 0;  ///< the node of lowest index
  float along_x[4] = {};
  float along_y[4] = {};  ///< adjacent nodes
};

// All are bit-identical on every instruction set. Real-time: yes.

void multiply(const ProductBlock& block) noexcept;
/// \param count  of nodes; a multiple of kProductColumns
void node_energies(const NodeStresses& stresses, std::size_t count, float* energies) noexcept;
/// Interpolates values of a grid whose rows are `columns` nodes apart; negative results are 0.
void interpolate_points(std::span<const GridPoint> points, const float* grid, std::size_t columns,
                        float* values) noexcept;

}  // namespace merkel
