#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/contact/kernel/taxel_kernel.hpp"
#include "core/contact/taxel_array.hpp"
#include "core/parameters/position.hpp"
#include "core/realtime_tag.hpp"
#include "core/simd/aligned_array.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The energy density at receptors under the pressures of a tactile array.
///
/// The skin is linear, so the stress is the sum of the taxels' stresses. It is computed at the
/// nodes of a grid at receptor depth, as a sum of products of a function of x and one of y
/// (SeparableStress), to 5e-5 of the largest stress under one taxel; the energy density at the
/// nodes is then interpolated by cubics. Farther than 12 mm from the array, it is 0. Real-time:
/// yes, after construction.
class TaxelField {
 public:
  /// Grids of more nodes are refused: a tick would take too long.
  static constexpr std::size_t kMaxNodes = 65536;

  /// \param orientation_deg  turns the array counterclockwise around its middle
  /// \param receptors  their positions on the patch
  TaxelField(const TaxelArray& array, double orientation_deg, const SkinParameters& skin,
             std::span<const Position> receptors);

  [[nodiscard]] std::size_t taxels() const noexcept { return taxels_.size(); }
  /// Computes the energy densities, unless the pressures are those of the last call.
  /// \param pressures_kPa  one per taxel. Negative ones, and those below the array's least_kPa, are
  /// 0.
  void press(std::span<const float> pressures_kPa) noexcept MERKEL_REALTIME;

  /// Sets all pressures to 0.
  void release() noexcept MERKEL_REALTIME;

  /// Of the last press(), in the order of the receptors.
  [[nodiscard]] std::span<const float> energies_kPa() const noexcept { return energies_; }
  /// Of the last press().
  [[nodiscard]] double force_mN() const noexcept { return force_mN_; }
  [[nodiscard]] double peak_pressure_kPa() const noexcept { return peak_kPa_; }
  /// The centre of the pressures, on the patch.
  [[nodiscard]] const Position& centre() const noexcept { return centre_; }
  /// The area of the taxels with at least a twentieth of the largest pressure.
  [[nodiscard]] double area_mm2() const noexcept { return area_mm2_; }
  [[nodiscard]] bool touching() const noexcept { return peak_kPa_ > 0.0; }
  /// Changes whenever the energy densities change.
  [[nodiscard]] std::uint64_t version() const noexcept { return version_; }

  /// Nodes of the grid that the receptors need.
  [[nodiscard]] static std::size_t nodes(const TaxelArray& array, double orientation_deg,
                                         const SkinParameters& skin,
                                         std::span<const Position> receptors);

 private:
  static constexpr std::size_t kStresses = 6;
  struct Grid {
    double spacing_mm = 0.0, left_mm = 0.0, bottom_mm = 0.0;
    std::size_t columns = 0;  ///< along x; a multiple of kProductRows
    std::size_t rows = 0;     ///< along y, adjacent in memory; a multiple of kProductColumns
  };
  struct Taxel {
    std::uint32_t column, row;
  };
  /// The factors of one stress, for all its terms.
  struct Factors {
    std::size_t terms = 0;
    AlignedArray<float> along_x;  ///< [block of node columns][term][taxel column][kProductRows]
    AlignedArray<float> along_y;  ///< [term][taxel row][node row]
  };

  static Grid grid_of(const TaxelArray& array, double orientation_deg, const SkinParameters& skin,
                      std::span<const Position> receptors);
  void place_taxels(const TaxelArray& array);
  void fill_factors(const TaxelArray& array, const SkinParameters& skin);
  void place_receptors(std::span<const Position> receptors, const TaxelArray& array,
                       double orientation_deg);
  void add_up(std::size_t stress) noexcept;

  Grid grid_;
  double area_of_taxel_mm2_;
  double least_kPa_;
  Position place_;  ///< of the array's middle,
  Position along_;  ///< and the direction of its x on the patch
  std::vector<Taxel> taxels_;
  std::vector<double> x_mm_, y_mm_;     ///< different coordinates of the taxels
  std::size_t columns_ = 0, rows_ = 0;  ///< of taxels; columns are padded to kProductRows
  Factors factors_[kStresses];
  std::size_t most_terms_ = 0;  ///< of a stress
  std::vector<float> pressures_;
  AlignedArray<float> by_column_;  ///< pressures: [block of columns][row][kProductRows]
  AlignedArray<float> sums_;       ///< over the taxels of a column: [term][column][node row]
  AlignedArray<float> stress_[kStresses];
  AlignedArray<float> node_energies_;
  std::vector<std::uint32_t> rows_in_use_;
  std::vector<std::uint32_t> sums_in_use_;
  std::vector<GridPoint> points_;  ///< of the receptors; those beyond the grid weigh 0
  std::vector<float> energies_;
  NodeStresses nodes_;
  double force_mN_ = 0.0;
  double peak_kPa_ = 0.0;
  double area_mm2_ = 0.0;
  Position centre_;
  std::uint64_t version_ = 0;
};

}  // namespace merkel
