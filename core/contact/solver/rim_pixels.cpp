#include "core/contact/solver/rim_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/contact/solver/rigid_contact.hpp"

namespace merkel {
namespace {

constexpr std::size_t kFinestRims = 8;  ///< pixels for one, in each direction
constexpr double kMaxRimPixels = 65536.0;
constexpr double kSmallerRimDepth = 0.4;  ///< of the larger one
constexpr RigidContact::Accuracy kRimAccuracy{.tolerance = 2e-4, .most_iterations = 300};
/// The pixel's own compliance is 1.12 pixels over E*; with the extra one, it stays positive.
constexpr double kMinCompliance = -0.45;
constexpr double kMaxCompliance = 30.0;
/// A pressure must grow by this factor between the two depths to give a line.
constexpr double kRimGrowth = 1.05;
/// A pixel whose heights differ by more than this, in pixels, is at a rim.
constexpr double kSteepRim = 0.05;

/// What the fine pixels of a coarse one carry.
struct Carried {
  double pressure = 0.0;  ///< mean
  double height = 0.0;    ///< where they carry
  double x = 0.0;
  double y = 0.0;
  double gap = 0.0;  ///< that the coarse pixels leave
};

Carried carried_by(std::span<const double> pressure, const HeightMap& fine, std::size_t first,
                   std::size_t factor) {
  Carried sum;
  for (std::size_t j = 0; j < factor; ++j) {
    for (std::size_t i = 0; i < factor; ++i) {
      const std::size_t at = first + j * fine.grid.columns + i;
      if (!(pressure[at] > 0.0)) continue;
      const auto offset = [&](std::size_t k) {
        return (static_cast<double>(k) + 0.5) / static_cast<double>(factor) - 0.5;
      };
      sum.pressure += pressure[at];
      sum.height += pressure[at] * fine.height_mm[at];
      sum.x += pressure[at] * offset(i);
      sum.y += pressure[at] * offset(j);
    }
  }
  if (!(sum.pressure > 0.0)) return sum;
  sum.height /= sum.pressure;
  sum.x /= sum.pressure;
  sum.y /= sum.pressure;
  sum.pressure /= static_cast<double>(factor * factor);
  return sum;
}

/// Whether the heights of the fine pixels of a coarse one and beside it differ, or some are bare.
bool uneven(const HeightMap& fine, std::size_t first, std::size_t factor, double rise_mm) {
  const std::size_t left = first % fine.grid.columns;
  const std::size_t below = first / fine.grid.columns;
  const auto from = [](std::size_t at) { return at == 0 ? at : at - 1; };
  double low = fine.height_mm[first];
  double high = low;
  for (std::size_t j = from(below); j < std::min(below + factor + 1, fine.grid.rows); ++j) {
    for (std::size_t i = from(left); i < std::min(left + factor + 1, fine.grid.columns); ++i) {
      const std::size_t at = j * fine.grid.columns + i;
      if (!(fine.coverage[at] > 0.99)) return true;
      low = std::min(low, fine.height_mm[at]);
      high = std::max(high, fine.height_mm[at]);
    }
  }
  return !(high - low <= rise_mm);
}

}  // namespace

void sharpen_rims(const TipHeight& tip, const LayeredMedium& medium, double depth_mm,
                  HeightMap& map) {
  const PixelGrid& grid = map.grid;
  std::size_t factor = kFinestRims;
  while (static_cast<double>(grid.pixels() * factor * factor) > kMaxRimPixels) --factor;
  if (factor < 2) return;
  const HeightMap fine = height_map(tip, {.pixel_mm = grid.pixel_mm / static_cast<double>(factor),
                                          .columns = grid.columns * factor,
                                          .rows = grid.rows * factor});
  RigidContact solver(medium, fine);
  PixelKernels kernels(medium, 1.0, grid, grid);
  const GridSpectrum kernel = kernels.kernel(PixelField::kDisplacement);
  GridSpectrum spectrum = kernels.transform().make_spectrum();
  std::vector<double> pressure(grid.pixels());
  std::vector<double> displaced(grid.pixels());
  std::vector<Carried> at_depth[2];
  const auto first_fine = [&](std::size_t at) {
    return (at / grid.columns * fine.grid.columns + at % grid.columns) * factor;
  };
  for (std::size_t k = 0; k < 2; ++k) {
    const double depth = (k == 0 ? kSmallerRimDepth : 1.0) * depth_mm;
    (void)solver.press(depth, kRimAccuracy);
    for (std::size_t at = 0; at < grid.pixels(); ++at) {
      at_depth[k].push_back(carried_by(solver.pressure_kPa(), fine, first_fine(at), factor));
      pressure[at] = at_depth[k].back().pressure;
    }
    kernels.transform().forward(pressure, grid.columns, grid.rows, spectrum);
    kernels.transform().convolve(spectrum, kernel, grid.columns, grid.rows, displaced);
    for (std::size_t at = 0; at < grid.pixels(); ++at) at_depth[k][at].gap = depth - displaced[at];
  }
  const double unit = grid.pixel_mm / medium.reduced_modulus_kPa();
  map.rims.assign(grid.pixels(), {});
  for (std::size_t at = 0; at < grid.pixels(); ++at) {
    const Carried& small = at_depth[0][at];
    const Carried& large = at_depth[1][at];
    if (!(large.pressure > 0.0)) continue;
    if (!uneven(fine, first_fine(at), factor, kSteepRim * grid.pixel_mm)) continue;
    const bool line = small.pressure > 0.0 && large.pressure > kRimGrowth * small.pressure;
    const double slope = line ? (large.gap - small.gap) / (large.pressure - small.pressure)
                              : (large.gap - large.height) / large.pressure;
    const double compliance = std::clamp(slope / unit, kMinCompliance, kMaxCompliance);
    map.rims[at] = {.known = true, .compliance = compliance, .x = large.x, .y = large.y};
    map.height_mm[at] = large.gap - compliance * unit * large.pressure;
    map.coverage[at] = 1.0;
  }
}

void place_loads(const HeightMap& gap, std::span<const double> pressure,
                 std::span<double> loads) noexcept {
  std::copy(pressure.begin(), pressure.end(), loads.begin());
  const std::size_t columns = gap.grid.columns;
  for (std::size_t j = 1; j + 1 < gap.grid.rows; ++j) {
    for (std::size_t i = 1; i + 1 < columns; ++i) {
      const std::size_t at = j * columns + i;
      const HeightMap::Rim& rim = gap.rims[at];
      if (!rim.known || !(pressure[at] > 0.0)) continue;
      const double x = 0.5 * rim.x * pressure[at];
      const double y = 0.5 * rim.y * pressure[at];
      loads[at + 1] += x;
      loads[at - 1] -= x;
      loads[at + columns] += y;
      loads[at - columns] -= y;
    }
  }
}

}  // namespace merkel
