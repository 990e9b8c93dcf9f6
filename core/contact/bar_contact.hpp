#pragma once

#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/skin/line_load.hpp"

namespace merkel {

/// A row of rigid flat-ended bars that press together, as in the gratings of Phillips & Johnson
/// (1981): side by side along x, all of the same length along y, ends at the same height.
struct BarTip {
  std::vector<double> widths_mm{5.0, 5.0, 5.0};  ///< along x
  std::vector<double> gaps_mm{3.0, 5.0};         ///< between neighbours: one fewer than widths
  double length_mm = 20.0;                       ///< along y

  static constexpr std::size_t kMostBars = 40;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
  /// From the first bar's outer edge to the last bar's.
  [[nodiscard]] double total_width_mm() const noexcept;
  /// How many line loads stand for all bars, where they are used from a distance on.
  [[nodiscard]] std::size_t loads(double finest_mm) const noexcept;
  /// Centre of a bar, the middle of the row at 0.
  [[nodiscard]] double centre_mm(std::size_t bar) const noexcept;
};

/// What a bar tip does to the skin at a depth of 1 mm. All of it is proportional to the depth: flat
/// ends touch with their whole area at any depth.
///
/// The pressure under bar i is Σ_k c_ik T_k(t)/√(1−t²), t = (x−x_i)/(width/2), the same all along
/// y; c makes the surface displacement on the middle line equal to the depth under all bars:
/// 2/(πE*)·∫ p(ξ)·asinh(L/(2|x−ξ|)) dξ = d. The logarithm in the kernel is integrated in closed
/// form, the rest by the Gauss-Chebyshev rule, whose nodes become the line loads returned.
struct BarContact {
  std::vector<LineLoad> loads;   ///< per mm of depth
  double force_mN_per_mm = 0.0;  ///< all bars together, per mm of depth

  /// \param finest_mm  the least distance from the surface at which the loads will be used; sets
  ///                   how many of them stand for a bar
  /// Real-time: no.
  [[nodiscard]] static BarContact solve(const BarTip& tip, double reduced_modulus_kPa,
                                        double finest_mm);
};

}  // namespace merkel
