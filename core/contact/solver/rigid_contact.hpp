#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/contact/solver/grid_transform.hpp"
#include "core/contact/solver/height_map.hpp"
#include "core/contact/solver/pixel_kernels.hpp"

namespace merkel {

/// Frictionless contact of a rigid tip with elastic skin: the pressure p ≥ 0 for which the surface
/// is displaced by d − g where p > 0 and by at least d − g elsewhere, g the gap before the press.
///
/// The pressure is uniform on each pixel. It minimises ½pᵀCp − pᵀ(d − g) under p ≥ 0, C the
/// response of the skin, by conjugate gradients with an active set (Polonsky & Keer, Wear 231
/// (1999) 206); C is applied by Fourier transforms without periodic images.
///
/// Uniform pressures under a flat end act as if its rim were 0.1745 pixels farther in, and a pixel
/// at a rim may be covered in part. An extra compliance of 1.7216·(1/s − 1)·pixel/E* of the pixels
/// at the rim corrects both, with s = coverage + 0.1745. Both numbers are computed for a straight
/// rim (test RigidContact.TheRimOfAFlatEndActsWhereItIs).
/// An instance holds its work space: one per thread. Real-time: yes, after construction.
class RigidContact {
 public:
  struct Accuracy {
    double tolerance = 1e-5;  ///< of the gap in contact (root mean square), relative to the depth
    int most_iterations = 400;
  };
  struct Solution {
    double depth_mm = 0.0;
    double force_mN = 0.0;
    double area_mm2 = 0.0;
    double peak_pressure_kPa = 0.0;
    double error = 0.0;  ///< of the gap in contact, relative to the depth
    int iterations = 0;
    bool converged = false;
  };

  /// \param gap  before the press: the tip's height plus the curvature of the skin
  RigidContact(const LayeredMedium& medium, const HeightMap& gap);

  /// Replaces the gap by one on the same grid.
  void set_gap(const HeightMap& gap) noexcept;
  /// Solves for a depth, starting from the present pressure: call reset() for a cold start.
  Solution press(double depth_mm, const Accuracy& accuracy) noexcept;
  void reset() noexcept;

  /// The same in parts: begin() or begin_with_force(), which finds the depth with the pressure,
  /// then iterate() until it returns true.
  void begin(double depth_mm) noexcept;
  /// \param deepest_mm  at a cold start, only what rises less can touch
  void begin_with_force(double force_mN, double deepest_mm) noexcept;
  /// Changes the force between two iterations.
  void aim(double force_mN) noexcept { force_mN_ = force_mN; }
  /// \return whether the solution is found
  bool iterate(const Accuracy& accuracy) noexcept;
  /// What the iterations have found so far.
  [[nodiscard]] Solution solution() const noexcept;
  /// Moves the pressure by whole pixels, as the gap moves: pixel (column, row) takes that of
  /// (column + columns, row + rows).
  void move_pressure(std::ptrdiff_t columns, std::ptrdiff_t rows) noexcept;

  [[nodiscard]] const PixelGrid& grid() const noexcept { return grid_; }
  /// Of each pixel, kPa.
  [[nodiscard]] std::span<const double> pressure_kPa() const noexcept { return pressure_; }
  /// Of the surface by the last solution, mm.
  [[nodiscard]] std::span<const double> displacement_mm() const noexcept { return displaced_; }

 private:
  /// What an iteration did to the set of pixels in contact.
  enum class Change { kNone, kLost, kGained };

  void displace(std::span<const double> pressure, std::span<double> displaced) noexcept;
  [[nodiscard]] double force_of_pressure_mN() const noexcept;
  /// In contact; the ends of rows and columns lie between pixels.
  [[nodiscard]] double area_mm2() const noexcept;
  /// Scales the pressure to the force. \return the factor; 0: nothing carries
  double carry_force() noexcept;
  /// The first pressure. \return false if nothing can touch
  [[nodiscard]] bool start(double deepest_mm) noexcept;
  void update_residual() noexcept;
  void measure(const Accuracy& accuracy) noexcept;
  /// Chooses the direction of the search. \return the step along it
  [[nodiscard]] double step_along(double kept) noexcept;
  [[nodiscard]] Change move(double step) noexcept;

  PixelGrid grid_;
  double modulus_kPa_;
  GridTransform transform_;
  GridSpectrum kernel_;
  GridSpectrum spectrum_;
  std::vector<double> gap_;         ///< infinite where nothing can touch
  std::vector<double> compliance_;  ///< extra, of pixels at a rim, mm/kPa
  std::vector<double> covered_;     ///< part of a pixel
  std::vector<double> pressure_;
  std::vector<double> displaced_;
  std::vector<double> residual_;   ///< displacement − depth + gap
  std::vector<double> direction_;  ///< of the search
  std::vector<double> response_;   ///< to the direction
  double squares_ = 0.0;           ///< Σ residual² in contact
  double squares_before_ = 1.0;    ///< those of the iteration before
  double force_mN_ = 0.0;          ///< to be carried; 0: the depth is given
  Change change_ = Change::kGained;
  Solution solution_;
  std::size_t touching_ = 0;  ///< pixels in contact
};

}  // namespace merkel
