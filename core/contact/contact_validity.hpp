#pragma once

#include <string>

#include "core/contact/contact_state.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// How far a sphere's contact is from what its law assumes, and the size of the error to expect.
struct ContactValidity {
  /// a/R above this is beyond small strain.
  static constexpr double kLargestRadiusRatio = 0.3;
  /// √(R*d)/h above this, a half-space is no model of skin on bone.
  static constexpr double kLargestHalfSpaceRatio = 0.1;
  /// √(R*d)/h above this, the Dimitriadis polynomial is more than 7 % off.
  static constexpr double kLargestDimitriadisRatio = 0.5;
  /// Where the scene does not say how deep the bone lies: the middle of a finger's 3 to 6 mm.
  static constexpr double kUsualThickness_mm = 4.0;

  double radius_ratio = 0.0;        ///< a/R, R the smaller of the two radii in contact
  bool exact_sphere = false;        ///< the law is that of the exact sphere
  double sphere_force_error = 0.0;  ///< F of a paraboloid over that of the exact sphere, less 1
  double layer_ratio = 0.0;         ///< √(R*d)/h
  double layer_force_error = 0.0;   ///< the law's F over the exact bonded layer's, less 1
  double largest_layer_ratio = kLargestHalfSpaceRatio;  ///< for the law that was used
  bool thickness_given = false;  ///< whether the scene gives h, or kUsualThickness_mm stands in
  double thickness_mm = kUsualThickness_mm;
  /// Both ratios are within their limits; that of the layer too where its thickness is the usual
  /// one: a half-space has no bone below it, a finger has.
  bool within = true;

  /// One sentence for a person.
  [[nodiscard]] std::string sentence() const;
};

/// \param contact  made by the law that `skin` asks for; \param radius_mm  of the sphere
/// Real-time: no.
[[nodiscard]] ContactValidity validity_of(const ContactState& contact, const SkinParameters& skin,
                                          double radius_mm);

}  // namespace merkel
