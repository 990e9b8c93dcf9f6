#pragma once

#include <cstddef>
#include <vector>

#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Elastic layers bonded to each other, from the surface inwards. The last one is bonded to bone,
/// or infinitely thick.
///
/// For each wave number ξ, the displacements of a layer are u_r = U(z)·J1(ξr) and u_z =
/// W(z)·J0(ξr). Its four solutions decay from its own faces, so no coefficient grows with the
/// thickness, and they stay finite at ν = 0.5. The surface (σz = −p, τ = 0), the bonded faces and
/// the base give a linear equation for all layers at once.
class LayeredMedium {
 public:
  explicit LayeredMedium(std::vector<SkinLayer> layers);
  /// The medium of a scene: its layers, or one material down to infinity or to the bone.
  explicit LayeredMedium(const SkinParameters& skin);

  /// Response at a depth to a unit pressure p(ξ): in units of p, with U in p/(2Gξ).
  struct Response {
    double radial = 0.0;      ///< 2Gξ·U
    double gradient = 0.0;    ///< 2G·W'
    double dilatation = 0.0;  ///< 2G·(ξU + W')/(1−2ν)
    double shear = 0.0;       ///< τ
    double poisson_ratio = 0.0;
  };
  [[nodiscard]] Response response(double wave_number_per_mm, double z_mm) const;
  /// The surface's displacement, W(0)·ξE*/2 − 1: 0 on a half-space of the first layer.
  [[nodiscard]] double excess_compliance(double wave_number_per_mm) const;

  /// Whether all layers together are one half-space.
  [[nodiscard]] bool half_space() const noexcept { return layers_.size() == 1 && !bone_; }
  [[nodiscard]] const std::vector<SkinLayer>& layers() const noexcept { return layers_; }
  /// E* of the first layer.
  [[nodiscard]] double reduced_modulus_kPa() const noexcept {
    return layers_.front().reduced_modulus_kPa();
  }

 private:
  /// The factors of the four solutions in every layer.
  [[nodiscard]] std::vector<double> factors(double wave_number_per_mm) const;

  std::vector<SkinLayer> layers_;
  bool bone_;
};

/// The response to a unit force that is spread evenly over a small disc of the surface: stress at a
/// depth and displacement of the surface, against the distance from its axis.
class PointResponse {
 public:
  /// \param disc_mm  radius of the disc
  /// \param farthest_mm  largest distance of interest
  PointResponse(const LayeredMedium& medium, double z_mm, double disc_mm, double farthest_mm);

  /// kPa per mN. Real-time: yes.
  [[nodiscard]] AxisymmetricStress stress(double r_mm) const noexcept;
  /// Displacement beyond that of a half-space of the first layer, mm per mN.
  [[nodiscard]] double excess_displacement_mm(double r_mm) const noexcept;

 private:
  enum Field : std::size_t { kSigmaR, kSigmaTheta, kSigmaZ, kTauRz, kExcess, kFields };
  [[nodiscard]] double at(Field field, double place) const noexcept;
  [[nodiscard]] double place_of(double r_mm) const noexcept;

  double scale_mm_;  ///< point k is at scale·sinh(k·step)
  std::size_t points_;
  std::vector<double> values_;  ///< [field][point]
};

}  // namespace merkel
