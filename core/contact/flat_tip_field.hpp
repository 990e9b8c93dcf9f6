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

/// Stress at receptor depth, and displacement of the surface, under a flat tip: superposed once on
/// a grid, then interpolated wherever the tip is.
///
/// On flat skin all of it is proportional to the depth. On a finger of radius R, a pin of radius a
/// touches as a plate does, by Hertz, until its rim is reached at d = a²/R, and as a punch from
/// there on. On a finger that is curved across with radius R, straight bars touch over a length
/// that grows with the depth d, L = min(bar length, 2·√(1.65·R·d)), and a press is the sum of its
/// increments, each that of flat bars of the length it finds: G(d) = ∫ field(L(d')) dd'. Tabulated
/// as G/d at depths that are even in √d. The factor 1.65 is of an independent solution (boundary
/// elements; core/README.md has the errors). The curvature along the finger, across the bars, is
/// neglected.
///
/// Positions are relative to the middle of the tip. The grid covers the contact and a margin around
/// it; beyond, the tip acts as a point load. Real-time: yes, after construction.
class FlatTipField {
 public:
  /// Solves the contact and fills the grid. Real-time: no (it takes some seconds).
  FlatTipField(const BarTip& tip, const SkinParameters& skin);
  /// The same of a round pin, from closed forms.
  FlatTipField(const PinTip& tip, const SkinParameters& skin);

  /// Whether the grid of a tip would have no more than four million nodes (220 MB), and no more
  /// than 4e8 loads to superpose on them (some ten seconds).
  [[nodiscard]] static bool fits(const BarTip& tip, const SkinParameters& skin) noexcept;
  [[nodiscard]] static bool fits(const PinTip& tip, const SkinParameters& skin) noexcept;

  struct Values {
    CartesianStress stress;     ///< kPa
    double displacement = 0.0;  ///< mm
  };
  /// By cubic interpolation in both directions.
  [[nodiscard]] Values at(double x_mm, double y_mm, double depth_mm) const noexcept MERKEL_REALTIME;

  [[nodiscard]] double force_mN(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The depth at which the tip presses with a force; ≤ 0 does not touch.
  [[nodiscard]] double depth_mm(double force_mN) const noexcept MERKEL_REALTIME;
  /// Far away, the surface is displaced by this/r.
  [[nodiscard]] double far_displacement_mm2(double depth_mm) const noexcept MERKEL_REALTIME;

  /// The line loads under bars at a depth, all increments of a press on a curved finger together;
  /// \param finest_mm  as in BarContact::solve.  Real-time: no.
  [[nodiscard]] static BarContact loads(const BarTip& tip, const SkinParameters& skin,
                                        double depth_mm, double finest_mm);
  /// From the tip's axis to its farthest corner.
  [[nodiscard]] double half_diagonal_mm() const noexcept { return half_diagonal_mm_; }

 private:
  static constexpr std::size_t kFields = 7;
  using Node = std::array<double, kFields>;
  /// The field of a press, per mm of depth.
  struct Table {
    double force_mN_per_mm = 0.0;
    std::vector<Node> nodes;
  };
  /// The two tables between which a depth lies, and their weights, times the depth.
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
  double half_diagonal_mm_;
  double spacing_mm_;
  double first_x_mm_;  ///< of the grid's first column; rows begin one spacing before y = 0
  std::size_t columns_;
  std::size_t rows_;
  /// One where all is proportional to the depth; else at depths (k/last)²·deepest, and after them
  /// the one by which the field grows from there on, where the bars touch with all of their length.
  std::vector<Table> tables_;
  double deepest_mm_ = 0.0;
};

}  // namespace merkel
