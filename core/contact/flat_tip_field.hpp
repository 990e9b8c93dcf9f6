#pragma once

#include <cstddef>
#include <vector>

#include "core/contact/bar_contact.hpp"
#include "core/contact/kernel/grid_interpolation.hpp"
#include "core/contact/pin_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Stress at receptor depth and displacement of the surface under a flat tip, computed once on a
/// grid and then interpolated at any position of the tip.
///
/// On flat skin, everything is proportional to the depth. On a finger of radius R, a pin of radius
/// a follows Hertz contact of a plate until its rim touches at d = a²/R, and punch contact from
/// there on. Bars press as in bar_press.hpp: G(d) = ∫ field(L(d')) dd' for the contact length L.
/// The table holds G/d at depths that are evenly spaced in √d.
///
/// Positions are relative to the middle of the tip. The grid covers the contact and a margin around
/// it; beyond the grid, the tip acts as a point load. Real-time: yes, after construction.
class FlatTipField {
 public:
  /// Solves the contact and fills the grid. Real-time: no (it takes a few seconds).
  FlatTipField(const BarTip& tip, const SkinParameters& skin);
  /// The same for a round pin, from closed forms.
  FlatTipField(const PinTip& tip, const SkinParameters& skin);

  /// Whether the grid of a tip has at most four million nodes (260 MB) and at most 4e8 loads to
  /// superpose on them (about ten seconds).
  [[nodiscard]] static bool fits(const BarTip& tip, const SkinParameters& skin) noexcept;
  [[nodiscard]] static bool fits(const PinTip& tip, const SkinParameters& skin) noexcept;

  struct Values {
    CartesianStress stress;     ///< kPa
    double displacement = 0.0;  ///< mm
  };
  /// Stress and displacement at a point, by cubic interpolation in both directions.
  [[nodiscard]] Values at(double x_mm, double y_mm, double depth_mm) const noexcept MERKEL_REALTIME;

  [[nodiscard]] double force_mN(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The depth at which the tip presses with a force. A force ≤ 0 means no contact.
  [[nodiscard]] double depth_mm(double force_mN) const noexcept MERKEL_REALTIME;
  /// At a large distance r, the surface is displaced by this value divided by r.
  [[nodiscard]] double far_displacement_mm2(double depth_mm) const noexcept MERKEL_REALTIME;

  /// Whether the field depends on the distance from the axis only: that of a pin.
  [[nodiscard]] bool round() const noexcept { return round_; }
  /// Distance between nodes.
  [[nodiscard]] double spacing_mm() const noexcept { return spacing_mm_; }
  /// Distance from the tip's axis to its farthest corner.
  [[nodiscard]] double half_diagonal_mm() const noexcept { return half_diagonal_mm_; }

 private:
  using Node = GridNode;
  /// The field of a press, per mm of depth.
  struct Table {
    double force_mN_per_mm = 0.0;
    std::vector<Node> nodes;
  };
  /// The two tables on either side of a depth, and their weights multiplied by the depth.
  struct Blend {
    const Table* table[2];
    double weight[2];
  };
  void lay_grid(double half_width_mm, double half_length_mm, double margin_mm);
  template <class Field>
  void fill(Table& table, Field field) const;
  void fill_curved(const BarTip& tip, const SkinParameters& skin);
  void fill_curved(const PinTip& tip, const SkinParameters& skin);
  [[nodiscard]] Values superposed(const BarContact& contact, double x_mm,
                                  double y_mm) const noexcept;
  [[nodiscard]] Values far_away(double force_mN, double x_mm, double y_mm) const noexcept;
  [[nodiscard]] Blend blend(double depth_mm) const noexcept;

  SkinMaterial skin_;
  double receptor_depth_mm_;
  bool round_;
  double half_diagonal_mm_;
  double spacing_mm_;
  double first_x_mm_;  ///< first column of the grid; rows begin one spacing before y = 0
  std::size_t columns_;
  std::size_t rows_;
  /// A single table if everything is proportional to the depth. Otherwise tables at depths
  /// (k/last)²·deepest, followed by the increment per mm beyond the deepest, where the bars touch
  /// over their whole length.
  std::vector<Table> tables_;
  double deepest_mm_ = 0.0;
};

}  // namespace merkel
