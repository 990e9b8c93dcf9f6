#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/contact/contact_state.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Stress at receptor depth and displacement of the surface under a sphere on a layer of skin
/// bonded to bone: the field of the exact contact (BondedLayer), tabulated once per scene by
/// contact radius and distance, per mN of force.
///
/// For each wave number ξ, the displacements of the layer are u_r = U(z)·J1(ξr) and u_z =
/// W(z)·J0(ξr), with four constants from the loaded surface (σz = −p, τ = 0) and the bonded base (U
/// = W = 0). The pressure of a contact is p(ξ) = E*/π·∫φ(t)·cos(ξt) dt. Gauss-Legendre panels
/// integrate over ξ until e^{−ξ·z} = 1e-13. Muki, Progress in Solid Mechanics 1 (1960) 401.
/// Real-time: yes, after construction.
class LayerField {
 public:
  /// \param skin  with a finite thickness and receptors at least kLeastDepth_mm deep
  /// \param largest_radius_mm  largest contact radius that the table covers, limited to 4
  /// thicknesses. Larger contacts keep the shape of the largest.
  /// Real-time: no (it takes about half a second).
  LayerField(const SkinParameters& skin, double largest_radius_mm);

  static constexpr double kLeastDepth_mm = 0.05;  ///< of receptors; the table does not resolve less
  static constexpr std::size_t kMostPoints = 4096;  ///< per table

  /// Distance between the table's points, mm; point k is at k·spacing from the axis.
  [[nodiscard]] double spacing_mm() const noexcept { return spacing_mm_; }
  [[nodiscard]] std::size_t size() const noexcept { return points_; }
  /// Number of points that cover a distance from the axis, including the neighbours that
  /// interpolation needs.
  [[nodiscard]] std::size_t points_within(double distance_mm) const noexcept MERKEL_REALTIME;

  /// The tabulated quantities.
  enum Field : std::size_t { kSigmaR, kSigmaTheta, kSigmaZ, kTauRz, kDisplacement, kFields };
  /// Writes one field of a contact, in kPa or mm, at the first values.size() points of the table.
  void profile(const ContactState& contact, Field field,
               std::span<double> values) const noexcept MERKEL_REALTIME;

  /// Stress at a distance r ≥ 0 from the axis; 0 beyond the table.
  [[nodiscard]] AxisymmetricStress stress(const ContactState& contact,
                                          double r_mm) const noexcept MERKEL_REALTIME;
  /// Downward displacement; negative where the skin bulges.
  [[nodiscard]] double displacement_mm(const ContactState& contact,
                                       double r_mm) const noexcept MERKEL_REALTIME;
  /// The radius within which the surface is displaced by at least `displacement_mm`; 0 if there is
  /// none.
  [[nodiscard]] double radius_of_displacement_mm(
      const ContactState& contact, double displacement_mm) const noexcept MERKEL_REALTIME;

 private:
  static constexpr std::size_t kRowWeights = 4;
  /// The rows around a contact radius, and their weights multiplied by the force.
  struct Rows {
    std::size_t row[kRowWeights];
    double weight[kRowWeights];
  };
  [[nodiscard]] Rows rows_of(const ContactState& contact) const noexcept;
  [[nodiscard]] double at(const Rows& rows, Field field, double r_mm) const noexcept;
  [[nodiscard]] const double* values(Field field, std::size_t row) const noexcept {
    return table_.data() + (field * rows_ + row) * points_;
  }

  double spacing_mm_;
  double row_spacing_mm_;  ///< between contact radii
  std::size_t points_;
  std::size_t rows_;
  std::vector<double> table_;  ///< [field][row][point], per mN
};

}  // namespace merkel
