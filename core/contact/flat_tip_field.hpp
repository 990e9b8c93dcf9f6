#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/contact/bar_contact.hpp"
#include "core/contact/pin_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Stress at receptor depth, and displacement of the surface, under a flat tip (bars or a pin) at
/// 1 mm depth: superposed once on a grid, then interpolated and scaled with the depth.
///
/// Positions are relative to the middle of the tip. The grid covers the tip and 10 mm around it;
/// beyond, the tip acts as a point load. Real-time: yes, after construction.
class FlatTipField {
 public:
  /// Solves the contact and fills the grid. Real-time: no (it takes about a second).
  FlatTipField(const BarTip& tip, const SkinParameters& skin);
  /// The same of a round pin, in closed form.
  FlatTipField(const PinTip& tip, const SkinParameters& skin);

  /// Whether the grid of a tip would have no more than four million nodes (220 MB), and no more
  /// than 4e8 loads to superpose on them (some ten seconds).
  [[nodiscard]] static bool fits(const BarTip& tip, const SkinParameters& skin) noexcept;
  [[nodiscard]] static bool fits(const PinTip& tip, const SkinParameters& skin) noexcept;

  struct Unit {
    CartesianStress stress;     ///< kPa per mm of depth
    double displacement = 0.0;  ///< mm per mm of depth
  };
  /// By cubic interpolation in both directions.
  [[nodiscard]] Unit at(double x_mm, double y_mm) const noexcept MERKEL_REALTIME;

  [[nodiscard]] double force_mN_per_mm() const noexcept { return force_mN_per_mm_; }
  /// Far away, the surface is displaced by depth·this/r.
  [[nodiscard]] double far_displacement_mm() const noexcept;
  /// From the tip's axis to its farthest corner.
  [[nodiscard]] double half_diagonal_mm() const noexcept { return half_diagonal_mm_; }
  /// The loads under the bars; none under a pin.
  [[nodiscard]] const BarContact& contact() const noexcept { return contact_; }

 private:
  static constexpr std::size_t kFields = 7;
  using Node = std::array<double, kFields>;
  template <class Field>
  void fill_grid(double half_width_mm, double half_length_mm, Field field);
  [[nodiscard]] Unit superposed(double x_mm, double y_mm) const noexcept;
  [[nodiscard]] Unit far_away(double x_mm, double y_mm) const noexcept;

  SkinMaterial skin_;
  double receptor_depth_mm_;
  double half_diagonal_mm_;
  BarContact contact_;
  double force_mN_per_mm_;
  double spacing_mm_;
  double first_x_mm_;  ///< of the grid's first column; rows begin one spacing before y = 0
  std::size_t columns_;
  std::size_t rows_;
  std::vector<Node> nodes_;
};

}  // namespace merkel
