#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/contact/far_field.hpp"
#include "core/contact/indenter.hpp"
#include "core/contact/solver/press_tables.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// Stress at receptor depth and displacement of the surface under any tip: the contact is solved
/// at several depths once per scene (PressTables) and then interpolated at any depth and position.
///
/// Between two tables, the field per mm of depth is linear in √d, as in Hertz contact. Deeper than
/// the last table, it grows as between the last two, which is exact once the whole tip touches.
/// Positions are relative to the tip's axis. Beyond the tables, the tip acts as a point load.
/// Real-time: yes, after construction.
class TipField {
 public:
  /// Solves the contact and fills the tables. Real-time: no (up to some seconds).
  TipField(const Indenter& indenter, const SkinParameters& skin);
  /// For one depth only.
  TipField(const Indenter& indenter, const SkinParameters& skin, double depth_mm);
  TipField(PressedTip tip, const SkinParameters& skin, double depth_mm);
  /// The field of a tip in a skin, solved once for all models that use it, and kept for later ones
  /// while all that are kept take at most 1 GB. Thread-safe. Real-time: no.
  [[nodiscard]] static std::shared_ptr<const TipField> shared(const Indenter& indenter,
                                                              const SkinParameters& skin);
  /// For a forked process, which has none of the threads that may be solving a field: nobody waits
  /// for them.
  static void shared_after_fork();

  /// Stress and displacement at a point, by cubic interpolation in both directions.
  [[nodiscard]] SkinField at(double x_mm, double y_mm,
                             double depth_mm) const noexcept MERKEL_REALTIME;

  [[nodiscard]] double force_mN(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The force over the area in contact. Real-time: yes.
  [[nodiscard]] double mean_pressure_kPa(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The depth at which the tip presses with a force. A force ≤ 0 means no contact.
  [[nodiscard]] double depth_mm(double force_mN) const noexcept MERKEL_REALTIME;

  /// The field at a depth: table `lower` times weight[0] plus the next table times weight[1].
  struct Blend {
    std::size_t lower = 0;
    double weight[2] = {};
  };
  [[nodiscard]] Blend blend(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The energy density of a blend is w0²·lower + w0·w1·cross + w1²·upper.
  struct Energies {
    double lower = 0.0;
    double cross = 0.0;
    double upper = 0.0;
  };
  /// Energies of two neighbouring tables in skin at rest, kPa per mm², at up to GridPoints::kCount
  /// points.
  void energies(std::size_t lower, std::span<const double> x_mm, std::span<const double> y_mm,
                std::span<Energies> found) const noexcept MERKEL_REALTIME;
  /// Displacements of the surface by two neighbouring tables, mm per mm; a blend weighs them.
  [[nodiscard]] std::array<double, 2> displacements(std::size_t lower, double x_mm,
                                                    double y_mm) const noexcept MERKEL_REALTIME;

  /// At a large distance r on a half-space, the surface is displaced by this value divided by r.
  [[nodiscard]] double far_displacement_mm2(double depth_mm) const noexcept MERKEL_REALTIME;
  /// Whether the skin is a half-space of one material.
  [[nodiscard]] bool on_half_space() const noexcept { return far_.on_half_space(); }
  /// Distance from the tip's axis within which the whole force acts.
  [[nodiscard]] double half_diagonal_mm() const noexcept { return half_diagonal_mm_; }
  /// The tables end this far from the axis at most.
  [[nodiscard]] double farthest_mm() const noexcept;
  [[nodiscard]] double deepest_mm() const noexcept { return press_.tables.back().depth_mm; }
  /// The largest energy density at a node of the tables, kPa.
  [[nodiscard]] double largest_energy_kPa(double depth_mm) const noexcept;
  [[nodiscard]] const PressTables& tables() const noexcept { return press_; }
  /// The energy densities at the nodes of a table in skin at rest, kPa per mm². Real-time: no.
  [[nodiscard]] std::vector<double> node_energies_kPa(std::size_t table) const;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  TipField(const PressedTip& tip, const LayeredMedium& medium, const SkinParameters& skin);
  void fill_energies();
  /// A point in columns and rows of the grid, and whether the nodes around it lie inside.
  struct Place {
    double column, row;
    bool inside;
  };
  [[nodiscard]] Place place(double x_mm, double y_mm) const noexcept;
  /// Fills a patch's weights. \return index of its first node, if it lies inside the grid
  [[nodiscard]] std::optional<std::size_t> place(double x_mm, double y_mm,
                                                 GridPatch& patch) const noexcept;

  SkinMaterial skin_;
  EnergyDensity kind_;
  FarField far_;
  double half_diagonal_mm_;
  bool proportional_;
  PressTables press_;
  /// Of each pair of tables: lower, cross and upper.
  std::vector<std::vector<EnergyNode>> energies_;
};

}  // namespace merkel
