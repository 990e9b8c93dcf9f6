#pragma once

#include <optional>
#include <vector>

#include "core/contact/solver/layered_medium.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Stress at receptor depth and displacement of the surface at a point.
struct SkinField {
  CartesianStress stress;     ///< kPa
  double displacement = 0.0;  ///< mm
};

/// The field of a solved contact far from it: that of a point load. Real-time: yes, after
/// construction.
class FarField {
 public:
  FarField(const LayeredMedium& medium, const SkinParameters& skin);

  /// At a point, from the load.
  [[nodiscard]] SkinField at(double force_mN, double x_mm,
                             double y_mm) const noexcept MERKEL_REALTIME;
  /// Whether the skin is a half-space of one material.
  [[nodiscard]] bool on_half_space() const noexcept { return !layers_; }
  [[nodiscard]] double surface_modulus_kPa() const noexcept { return surface_modulus_kPa_; }

 private:
  double poisson_ratio_;
  double receptor_depth_mm_;
  double surface_modulus_kPa_;
  std::optional<PointResponse> layers_;
};

/// The largest energy density that 1 mN causes at a distance or farther, tabulated. Real-time: yes,
/// after construction.
class FarEnergy {
 public:
  FarEnergy(const FarField& far, const SkinParameters& skin);

  [[nodiscard]] double at(double r_mm) const noexcept MERKEL_REALTIME;
  /// Beyond this distance, the energy density is lower; infinite: nowhere in the table.
  [[nodiscard]] double reach_mm(double energy_kPa) const noexcept MERKEL_REALTIME;

 private:
  std::vector<double> values_kPa_;
};

}  // namespace merkel
