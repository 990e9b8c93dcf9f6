#pragma once

#include <limits>
#include <vector>

#include "core/math/gauss_legendre.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// How much stiffer skin of thickness h, bonded to bone, is than a half-space: the ratio of its
/// force to the Hertz force at the same depth, as a polynomial in χ = √(R*·d)/h.
///
/// 1 − 2α/π·χ + 4α²/π²·χ² − 8/π³·(α³ + 4π²/15·β)·χ³ + 16α/π⁴·(α³ + 3π²/5·β)·χ⁴ with
/// α = −(1.2876 − 1.4678ν + 1.3442ν²)/(1−ν), β = (0.6387 − 1.0277ν + 1.5164ν²)/(1−ν)
/// Dimitriadis et al., Biophys. J. 82 (2002) 2798, Eq. 12 and 13. The polynomial assumes a contact
/// radius of √(R*·d) and so underestimates the exact force (BondedLayer, ν = 0.48) by 1 % at χ =
/// 0.2, 7 % at 0.5 and 17 % at 1. Real-time: yes.
[[nodiscard]] double dimitriadis_factor(double chi, double poisson_ratio) noexcept MERKEL_REALTIME;

/// The contact of a paraboloid with a bonded layer. Lengths are in units of the thickness, R = 1.
struct LayerContact {
  double radius = 0.0;
  double depth = 0.0;
  double force = 0.0;                 ///< divided by E*
  std::vector<QuadratureNode> nodes;  ///< on 0 … radius
  std::vector<double> phi;            ///< solution of the Fredholm equation at the nodes
};

/// The exact linear-elastic contact of a paraboloid with a layer bonded to a rigid base.
///
/// With u the surface displacement and p the pressure in Hankel space, u = 2/E*·K(ξh)/ξ·p and
/// K(x) = (2κ·sinh 2x − 4x)/(2κ·cosh 2x + κ² + 1 + 4x²), κ = 3−4ν (Lebedev & Ufliand 1958). The
/// contact of radius a solves the Fredholm equation
/// φ(x) − 1/π·∫₋ₐᵃ M(x−t)·φ(t) dt = d − x²/R,  M(y) = ∫₀^∞ (1−K(ξh))·cos(ξy) dξ,  φ(a) = 0,
/// F = E*·∫₋ₐᵃ φ dx, p(ξ) = E*/π·∫₀ᵃ φ(t)·cos(ξt) dt. Real-time: no.
class LayerEquation {
 public:
  explicit LayerEquation(double poisson_ratio);

  /// 1 − K(x), which falls off as e^{−2x}.
  [[nodiscard]] static double stiffening(double x, double poisson_ratio) noexcept;
  /// \param radius  ≥ 0; at 0 (a point), only the shape of φ is meaningful
  [[nodiscard]] LayerContact solve(double radius) const;

 private:
  /// h·M(y), distances in units of h.
  [[nodiscard]] double kernel(double y) const noexcept;
  std::vector<QuadratureNode> nodes_;  ///< in ξ, weighted with 1 − K
};

/// Force and contact radius relative to Hertz, which depend on χ and ν alone: a table of solutions
/// of LayerEquation.
class BondedLayer {
 public:
  static constexpr double kLargestRadius = 4.0;  ///< of the contacts in the table, in thicknesses

  /// Solves the equation for contact radii up to kLargestRadius; if only values up to
  /// `largest_chi` are needed, only for those. Real-time: no.
  explicit BondedLayer(double poisson_ratio,
                       double largest_chi = std::numeric_limits<double>::infinity());

  /// F divided by the Hertz force at the same depth. Real-time: yes.
  [[nodiscard]] double force_factor(double chi) const noexcept MERKEL_REALTIME;
  /// a divided by √(R*·d). Real-time: yes.
  [[nodiscard]] double radius_factor(double chi) const noexcept MERKEL_REALTIME;
  /// The largest χ in the table. Beyond it both factors are extrapolated as powers of χ.
  [[nodiscard]] double largest_chi() const noexcept { return rows_.back().chi; }

 private:
  struct Row {
    double chi;
    double force;
    double radius;
  };
  [[nodiscard]] double look_up(double chi, double Row::*member) const noexcept;

  std::vector<Row> rows_;  ///< in order of χ
};

}  // namespace merkel
