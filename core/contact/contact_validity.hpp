#pragma once

#include <string>

#include "core/records/contact_state.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// How far a sphere's contact is outside the assumptions of Hertz, and the size of the error to
/// expect.
struct ContactValidity {
  /// Above this a/R, small-strain theory does not hold.
  static constexpr double kLargestRadiusRatio = 0.3;
  /// Above this √(R*d)/h, a half-space does not represent skin on bone.
  static constexpr double kLargestHalfSpaceRatio = 0.1;
  /// h, the usual depth of the bone: the middle of a finger's 3 to 6 mm.
  static constexpr double kUsualThickness_mm = 4.0;

  double radius_ratio = 0.0;        ///< a/R, where R is the smaller radius of the two bodies
  double sphere_force_error = 0.0;  ///< F of a paraboloid divided by F of the exact sphere, minus 1
  double layer_ratio = 0.0;         ///< √(R*d)/h
  double layer_force_error = 0.0;   ///< F divided by that on skin of h on bone, minus 1
  /// Whether both ratios are within their limits. The layer ratio counts, because a real finger has
  /// bone below its skin and a half-space does not.
  bool within = true;

  /// The result as one sentence for the user.
  [[nodiscard]] std::string sentence() const;
};

/// \param contact  by SphereLaw
/// \param radius_mm  of the sphere
/// Real-time: no.
[[nodiscard]] ContactValidity validity_of(const ContactState& contact, const SkinParameters& skin,
                                          double radius_mm);

}  // namespace merkel
