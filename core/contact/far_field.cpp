#include "core/contact/far_field.hpp"

#include <cmath>
#include <numbers>

#include "core/skin/point_load.hpp"

namespace merkel {
namespace {

/// Distances over which the response of layers to a point load is tabulated.
constexpr double kFarthest_mm = 60.0;
constexpr double kPointDisc_mm = 0.05;

}  // namespace

FarField::FarField(const LayeredMedium& medium, const SkinParameters& skin)
    : poisson_ratio_(SkinMaterial(skin).poisson_ratio()),
      receptor_depth_mm_(skin.receptor_depth_mm),
      surface_modulus_kPa_(medium.reduced_modulus_kPa()) {
  if (!medium.half_space()) {
    layers_.emplace(medium, receptor_depth_mm_, kPointDisc_mm, kFarthest_mm);
  }
}

SkinField FarField::at(double force_mN, double x_mm, double y_mm) const noexcept {
  const double r = std::hypot(x_mm, y_mm);
  const double half_space_mm = force_mN / (std::numbers::pi * surface_modulus_kPa_) / r;
  if (layers_) {
    return {.stress = cartesian(layers_->stress(r), x_mm, y_mm) * force_mN,
            .displacement = half_space_mm + force_mN * layers_->excess_displacement_mm(r)};
  }
  return {.stress = cartesian(point_load_stress(force_mN, poisson_ratio_, r, receptor_depth_mm_),
                              x_mm, y_mm),
          .displacement = half_space_mm};
}

}  // namespace merkel
