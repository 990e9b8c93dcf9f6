#pragma once

#include <cstddef>
#include <vector>

#include "core/skin/skin_material.hpp"

namespace merkel {

/// Stress at receptor depth and displacement of the surface under a sphere on a layer of skin
/// bonded to bone, by contact radius (rows) and distance from the axis (points), per mN of force.
///
/// For each wave number ξ, the displacements of the layer are u_r = U(z)·J1(ξr) and u_z =
/// W(z)·J0(ξr), with four constants from the loaded surface (σz = −p, τ = 0) and the bonded base (U
/// = W = 0). The pressure of a contact is p(ξ) = E*/π·∫φ(t)·cos(ξt) dt. Gauss-Legendre panels
/// integrate over ξ until e^{−ξ·z} = 1e-13. Muki, Progress in Solid Mechanics 1 (1960) 401.
struct LayerTable {
  static constexpr double kLeastDepth_mm = 0.05;  ///< of receptors; the table does not resolve less
  static constexpr std::size_t kMostPoints = 4096;
  enum Field : std::size_t { kSigmaR, kSigmaTheta, kSigmaZ, kTauRz, kDisplacement, kFields };

  /// One field of a contact radius, `points` values.
  [[nodiscard]] const double* of(Field field, std::size_t row) const noexcept {
    return values.data() + (field * rows + row) * points;
  }
  [[nodiscard]] double* of(Field field, std::size_t row) noexcept {
    return values.data() + (field * rows + row) * points;
  }

  double spacing_mm = 0.0;      ///< between points; point k is at k·spacing from the axis
  double row_spacing_mm = 0.0;  ///< between contact radii
  std::size_t points = 0;
  std::size_t rows = 0;
  std::vector<double> values;  ///< [field][row][point], in kPa or mm per mN
};

/// \param skin  with a finite thickness and receptors at least kLeastDepth_mm deep
/// \param largest_radius_mm  largest contact radius in the table, limited to 4 thicknesses
/// Real-time: no (it takes about half a second).
[[nodiscard]] LayerTable layer_table(const SkinParameters& skin, double largest_radius_mm);

}  // namespace merkel
