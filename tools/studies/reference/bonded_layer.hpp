#pragma once

#include <utility>
#include <vector>

namespace merkel::reference {

/// The contact of a paraboloid with an elastic layer bonded to a rigid base.
///
/// With u the surface displacement and p the pressure in Hankel space, u = 2/E*·K(ξh)/ξ·p and
/// K(x) = (2κ·sinh 2x − 4x)/(2κ·cosh 2x + κ² + 1 + 4x²), κ = 3−4ν (Lebedev & Ufliand 1958). The
/// contact of radius a solves the Fredholm equation
/// φ(x) − 1/π·∫₋ₐᵃ M(x−t)·φ(t) dt = d − x²/R,  M(y) = ∫₀^∞ (1−K(ξh))·cos(ξy) dξ,  φ(a) = 0,
/// F = E*·∫₋ₐᵃ φ dx.
class BondedLayer {
 public:
  explicit BondedLayer(double poisson_ratio);

  /// 1 − K(x), which falls off as e^{−2x}.
  [[nodiscard]] static double stiffening(double x, double poisson_ratio);
  /// Force and contact radius over those of a half-space at the same depth, at χ = √(R·d)/h.
  struct Factors {
    double force = 1.0;
    double radius = 1.0;
  };
  [[nodiscard]] Factors factors(double chi) const;
  [[nodiscard]] double force_factor(double chi) const { return factors(chi).force; }

 private:
  /// Depth and force/E* of a contact radius, in units of the thickness, for R = 1.
  [[nodiscard]] std::pair<double, double> solve(double radius) const;

  std::vector<std::pair<double, double>> nodes_;  ///< ξ and its weight, times 1 − K
};

}  // namespace merkel::reference
