#pragma once

#include <cstddef>
#include <span>

#include "core/contact/contact_state.hpp"
#include "core/contact/layer_table.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Stress at receptor depth and displacement of the surface under a sphere on a layer of skin
/// bonded to bone: the field of the exact contact (BondedLayer), computed once per scene
/// (LayerTable) and then interpolated. Larger contacts than the table's keep the shape of the
/// largest. Real-time: yes, after construction.
class LayerField {
 public:
  using Field = LayerTable::Field;
  static constexpr double kLeastDepth_mm = LayerTable::kLeastDepth_mm;  ///< of receptors
  static constexpr std::size_t kMostPoints = LayerTable::kMostPoints;

  /// \param skin, largest_radius_mm  as for layer_table(). Real-time: no.
  LayerField(const SkinParameters& skin, double largest_radius_mm)
      : table_(layer_table(skin, largest_radius_mm)) {}

  /// Distance between the table's points, mm; point k is at k·spacing from the axis.
  [[nodiscard]] double spacing_mm() const noexcept { return table_.spacing_mm; }
  [[nodiscard]] std::size_t size() const noexcept { return table_.points; }
  /// Number of points that cover a distance from the axis, including the neighbours that
  /// interpolation needs.
  [[nodiscard]] std::size_t points_within(double distance_mm) const noexcept MERKEL_REALTIME;

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

  LayerTable table_;
};

}  // namespace merkel
