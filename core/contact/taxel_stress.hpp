#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "core/contact/solver/layered_medium.hpp"
#include "core/contact/taxel_array.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The stress at receptor depth under one taxel with a pressure of 1 kPa: point loads, integrated
/// over the taxel by Gauss-Legendre quadrature, to 5e-6 kPa: rectangles and discs, in one material
/// or in layers. Love (1929) has the closed form for a rectangle on a half-space.
class TaxelStress {
 public:
  static constexpr std::size_t kComponents = 6;
  /// σx, σy, σz, τxy, τyz, τzx, kPa.
  using Components = std::array<double, kComponents>;

  /// \param farthest_mm  largest distance of interest
  TaxelStress(const TaxelArray& array, const SkinParameters& skin, double farthest_mm);
  /// \param x_mm, y_mm  from the taxel's centre
  [[nodiscard]] Components at(double x_mm, double y_mm) const;

 private:
  struct Load {
    double x_mm, y_mm, force_mN;
  };
  double poisson_ratio_;
  double depth_mm_;
  std::unique_ptr<const PointResponse> layered_;  ///< null: a half-space
  std::vector<Load> loads_;
};

/// A component of the stress as a sum of products, Σ u_r(x)·v_r(y): its cross approximation with
/// the largest remaining value as pivot (Bebendorf 2000). Real-time: no.
class SeparableStress {
 public:
  /// \param x_mm, y_mm  offsets, from which the pivots are chosen, and where the error is checked
  /// \param error_kPa  largest at these offsets
  SeparableStress(const TaxelStress& stress, std::size_t component, const std::vector<double>& x_mm,
                  const std::vector<double>& y_mm, double error_kPa);

  [[nodiscard]] std::size_t terms() const noexcept { return pivots_.size(); }
  /// u_r at an offset along x, for each term.
  [[nodiscard]] std::vector<double> along_x(double x_mm) const;
  /// v_r at an offset along y.
  [[nodiscard]] std::vector<double> along_y(double y_mm) const;

 private:
  struct Pivot {
    double x_mm, y_mm;
    double value;           ///< of the remainder
    std::vector<double> x;  ///< u of the terms before it, there
    std::vector<double> y;  ///< v of the terms before it, there
  };
  const TaxelStress& stress_;
  std::size_t component_;
  std::vector<Pivot> pivots_;
};

}  // namespace merkel
