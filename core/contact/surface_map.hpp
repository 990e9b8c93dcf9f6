#pragma once

#include <chrono>
#include <cstddef>
#include <optional>

#include "core/contact/indenter.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// How the contact of a sliding surface is computed: the pixels of the contact and of the fields
/// around it, which have the same middle, and how often. Each solution takes a fixed number of
/// parts, spread over the ticks of a period.
struct SlidingPlan {
  PixelGrid contact;
  PixelGrid window;
  int parts_per_tick = 1;
  int ticks = 1;  ///< from one solution to the next

  static constexpr int kIterations = 7;
  /// The gap; the iterations; two fields at a time.
  static constexpr int kParts = 1 + kIterations + 4;

  /// From a reading of the probe to the contact that it makes, in ticks.
  [[nodiscard]] int latency() const noexcept { return 2 * ticks; }

  /// The finest pixels that a tick can afford, at most a quarter of the receptors' depth and a
  /// sixth of the smallest part; empty if even the coarsest (2/5 and a quarter) are too many.
  [[nodiscard]] static std::optional<SlidingPlan> of(const Indenter& surface,
                                                     const SkinParameters& skin,
                                                     std::chrono::nanoseconds tick);
};

/// The heights of a surface at pixels that stay fixed to it: of all of it or of one period.
class SurfaceMap {
 public:
  SurfaceMap(const Indenter& surface, const SkinParameters& skin, double pixel_mm);

  /// A pixel's place, from the middle of the surface.
  [[nodiscard]] double x_mm(std::ptrdiff_t column) const noexcept;
  [[nodiscard]] double y_mm(std::ptrdiff_t row) const noexcept;
  /// A place in pixels, from the first one.
  [[nodiscard]] double place_x(double x_mm) const noexcept {
    return x_mm / map_.grid.pixel_mm + 0.5 * static_cast<double>(map_.grid.columns - 1);
  }
  [[nodiscard]] double place_y(double y_mm) const noexcept {
    return y_mm / map_.grid.pixel_mm + 0.5 * static_cast<double>(map_.grid.rows - 1);
  }
  /// The pixel nearest to a place.
  [[nodiscard]] std::ptrdiff_t column_at(double x_mm) const noexcept;
  [[nodiscard]] std::ptrdiff_t row_at(double y_mm) const noexcept;
  /// Fills heights and coverages from a first pixel on. Real-time: yes.
  void copy(std::ptrdiff_t first_column, std::ptrdiff_t first_row, HeightMap& to) const noexcept;
  /// Whether a place lies on the surface. Real-time: yes.
  [[nodiscard]] bool contains(double x_mm, double y_mm) const noexcept;

 private:
  HeightMap map_;
  double base_mm_;  ///< height beyond the map
  bool repeats_x_;
  bool repeats_y_;
};

}  // namespace merkel
