#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// The relation between depth, force and contact radius of a sphere.
enum class ContactLaw {
  kHertz,    ///< a paraboloid on elastic skin (the paper)
  kSneddon,  ///< an exact sphere: the contact is solved
};

/// The strain energy density that drives the receptors.
enum class EnergyDensity {
  kDistortional,  ///< as in the paper, 3·τ_oct²/(4G)
  kFull,          ///< with the volumetric part, (σ1+σ2+σ3)²/(18K)
};

/// An elastic layer of skin. Poisson's ratio may be 0.5.
struct SkinLayer {
  double thickness_mm = 0.0;        ///< must be set; infinite: the last layer of a half-space
  double youngs_modulus_kPa = 0.0;  ///< must be set
  double poisson_ratio = 0.48;

  /// E* = E/(1−ν²).
  [[nodiscard]] double reduced_modulus_kPa() const noexcept {
    return youngs_modulus_kPa / (1.0 - poisson_ratio * poisson_ratio);
  }
  [[nodiscard]] static FieldTable fields();
};

/// Layers from the surface inwards.
struct SkinLayers {
  static constexpr std::size_t kMax = 10;

  std::array<SkinLayer, kMax> layer{};
  std::size_t count = 0;

  [[nodiscard]] bool empty() const noexcept { return count == 0; }
  [[nodiscard]] std::span<const SkinLayer> all() const noexcept { return {layer.data(), count}; }
  [[nodiscard]] std::span<SkinLayer> all() noexcept { return {layer.data(), count}; }
};

/// Material and geometry of the skin.
struct SkinParameters {
  /// Deep presses of small tips would stiffen the skin without limit.
  static constexpr double kMaxStiffening = 20.0;

  double epidermis_kPa = 136.0;                                ///< Young's modulus of the epidermis
  double dermis_kPa = 80.0;                                    ///< Young's modulus of the dermis
  double poisson_ratio = 0.48;                                 ///< of both layers
  double radius_mm = std::numeric_limits<double>::infinity();  ///< curvature radius; inf is flat
  /// Curvature radius along the finger, x; radius_mm is the radius across it. 0: the same.
  double radius_along_mm = 0.0;
  /// Highest point of a curved finger, in patch coordinates. A sphere whose axis is offset by X
  /// from it touches the finger at X·k/(k + 1/R_skin), k = 1/R; a plate always touches the apex.
  /// Without an apex, the skin curves away from the axis of the sphere, at any position.
  std::optional<Position> apex;
  double receptor_depth_mm = 0.65;  ///< z0, the epidermal-dermal junction
  double thickness_mm =
      std::numeric_limits<double>::infinity();  ///< h, depth of the bone; inf: none
  /// d1 of skin that stiffens with the depth of a press: all moduli grow by e^(d/d1). inf: none.
  double stiffening_mm = std::numeric_limits<double>::infinity();
  /// p1 of skin that stiffens with the mean pressure p of a contact: all moduli grow by 1 + p/p1.
  /// inf: none.
  double stiffening_kPa = std::numeric_limits<double>::infinity();
  ContactLaw contact_law = ContactLaw::kHertz;
  EnergyDensity energy_density = EnergyDensity::kDistortional;
  /// Bonded layers from the surface inwards, which replace the moduli and the thickness above.
  SkinLayers layers;
  bool bone = true;  ///< the last layer lies on bone; otherwise it has no end

  [[nodiscard]] bool layered() const noexcept { return std::isfinite(thickness_mm); }
  [[nodiscard]] bool stiffens() const noexcept {
    return std::isfinite(stiffening_mm) || std::isfinite(stiffening_kPa);
  }
  /// The moduli under a press over those of skin at rest, from 1 to kMaxStiffening by pressure:
  /// e^(depth/d1), or 1/(1 − p0/p1), which is 1 + p/p1 with the actual mean pressure p.
  /// \param pressure_kPa  p0, the mean pressure that the same depth takes in skin at rest
  /// Real-time: yes.
  [[nodiscard]] double stiffening_at(double depth_mm,
                                     double pressure_kPa) const noexcept MERKEL_REALTIME;
  /// The same from the actual mean pressure. Real-time: yes.
  [[nodiscard]] double stiffening_under(double depth_mm,
                                        double pressure_kPa) const noexcept MERKEL_REALTIME;
  /// Depth of the bone; infinite: none.
  [[nodiscard]] double bone_depth_mm() const noexcept;
  /// Curvature radius along the finger; radius_mm is the one across it. Real-time: yes.
  [[nodiscard]] double finger_along_mm() const noexcept MERKEL_REALTIME {
    return radius_along_mm > 0.0 ? radius_along_mm : radius_mm;
  }
  /// Whether both curvature radii are the same: spheres touch it in a circle.
  [[nodiscard]] bool round() const noexcept { return finger_along_mm() == radius_mm; }

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// The skin as one isotropic elastic solid.
///
/// E = 2/(1/E_epidermis + 1/E_dermis), the equal-weight series (Reuss) mean of the two layers, or
/// that of the layer in which the receptors lie, if the skin has its own layers;
/// E* = E/(1−ν²) under a rigid indenter (Eq. 1, corrected); G = E/(2(1+ν)) (Eq. 3, corrected).
/// Real-time: yes, after construction.
class SkinMaterial {
 public:
  explicit SkinMaterial(const SkinParameters& parameters) noexcept;
  SkinMaterial(double youngs_modulus_kPa, double poisson_ratio) noexcept;

  [[nodiscard]] double youngs_modulus_kPa() const noexcept { return youngs_modulus_kPa_; }
  [[nodiscard]] double poisson_ratio() const noexcept { return poisson_ratio_; }
  /// E*, for contact with a rigid indenter.
  [[nodiscard]] double reduced_modulus_kPa() const noexcept;
  /// E* for an indenter that is also elastic: 1/E* = (1−ν₁²)/E₁ + (1−ν₂²)/E₂.
  [[nodiscard]] double reduced_modulus_kPa(const SkinMaterial& indenter) const noexcept;
  /// G, the shear modulus.
  [[nodiscard]] double shear_modulus_kPa() const noexcept;
  /// K = E/(3(1−2ν)), the bulk modulus; infinite at ν = 0.5.
  [[nodiscard]] double bulk_modulus_kPa() const noexcept;

 private:
  double youngs_modulus_kPa_;
  double poisson_ratio_;
};

}  // namespace merkel
