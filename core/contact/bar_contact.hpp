#pragma once

#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/skin/line_load.hpp"

namespace merkel {

/// A row of rigid flat-ended bars that move together, as in the gratings of Phillips & Johnson
/// (1981). The bars lie side by side along x, have the same length along y, and end at the same
/// height.
struct BarTip {
  std::vector<double> widths_mm{5.0, 5.0, 5.0};  ///< along x
  std::vector<double> gaps_mm{3.0, 5.0};         ///< between neighbours; one fewer than widths
  double length_mm = 20.0;                       ///< along y

  static constexpr std::size_t kMostBars = 40;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
  /// Distance from the first bar's outer edge to the last bar's.
  [[nodiscard]] double total_width_mm() const noexcept;
  /// Number of line loads that represent all bars at distances of at least `finest_mm`.
  [[nodiscard]] std::size_t loads(double finest_mm) const noexcept;
  /// x of a bar's centre, relative to the middle of the row.
  [[nodiscard]] double centre_mm(std::size_t bar) const noexcept;
};

/// The load of a bar tip on the skin at a depth of 1 mm. Everything scales with the depth, because
/// flat ends touch with their whole area at any depth.
///
/// The pressure under bar i is Σ_k c_ik T_k(t)/√(1−t²), t = (x−x_i)/(width/2), constant along y.
/// The coefficients c make the surface displacement on the middle line equal to the depth under all
/// bars: 2/(πE*)·∫ p(ξ)·asinh(L/(2|x−ξ|)) dξ = d. The logarithm in the kernel is integrated in
/// closed form, the rest by the Gauss-Chebyshev rule, whose nodes become the line loads returned.
struct BarContact {
  std::vector<LineLoad> loads;   ///< per mm of depth
  double force_mN_per_mm = 0.0;  ///< all bars together, per mm of depth

  /// \param finest_mm  the smallest distance from the surface at which the loads are used; sets how
  ///                   many loads represent a bar
  /// Real-time: no.
  [[nodiscard]] static BarContact solve(const BarTip& tip, double reduced_modulus_kPa,
                                        double finest_mm);
};

}  // namespace merkel
