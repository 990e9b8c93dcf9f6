#pragma once

#include <string>

#include "core/contact/contact_state.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// How far a sphere's contact is outside the assumptions of its law, and the size of the error to
/// expect.
struct ContactValidity {
  /// Above this a/R, small-strain theory does not hold.
  static constexpr double kLargestRadiusRatio = 0.3;
  /// Above this √(R*d)/h, a half-space does not represent skin on bone.
  static constexpr double kLargestHalfSpaceRatio = 0.1;
  /// Above this √(R*d)/h, the Dimitriadis polynomial is off by more than 7 %.
  static constexpr double kLargestDimitriadisRatio = 0.5;
  /// Used if the scene does not give the depth of the bone: the middle of a finger's 3 to 6 mm.
  static constexpr double kUsualThickness_mm = 4.0;

  double radius_ratio = 0.0;        ///< a/R, where R is the smaller radius of the two bodies
  bool exact_sphere = false;        ///< the law is that of an exact sphere
  double sphere_force_error = 0.0;  ///< F of a paraboloid divided by F of the exact sphere, minus 1
  double layer_ratio = 0.0;         ///< √(R*d)/h
  double layer_force_error = 0.0;   ///< the law's F divided by the solved layer's, minus 1
  double largest_layer_ratio = kLargestHalfSpaceRatio;  ///< limit for the law used
  bool thickness_given = false;  ///< whether the scene gives h; if not, h is kUsualThickness_mm
  double thickness_mm = kUsualThickness_mm;
  /// Whether both ratios are within their limits. The layer ratio is checked even with the default
  /// thickness, because a real finger has bone below its skin and a half-space does not.
  bool within = true;

  /// The result as one sentence for the user.
  [[nodiscard]] std::string sentence() const;
};

/// \param contact  computed by the closed form that `skin` selects
/// \param radius_mm  of the sphere
/// Real-time: no.
[[nodiscard]] ContactValidity validity_of(const ContactState& contact, const SkinParameters& skin,
                                          double radius_mm);

}  // namespace merkel
