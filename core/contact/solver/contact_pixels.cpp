#include "core/contact/solver/contact_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/contact/solver/pixel_kernels.hpp"

namespace merkel {
namespace {

constexpr double kPixelsPerPart = 48.0;
constexpr double kPixelsPerFeature = 24.0;
constexpr int kRegionSamples = 128;  ///< of the gap, in each direction
constexpr int kMaxZooms = 12;
constexpr double kZoomed = 0.7;  ///< a region that shrinks less is found
/// Incompressible layers bulge into contact beside the part that lies below the depth.
constexpr double kBulge = 1.1;

/// What of a tip can touch at a depth.
struct TouchingRegion {
  Position middle;
  double half_width_mm;
  double half_length_mm;
  double part_mm = 0.0;  ///< the width of its parts: 4 × area / perimeter
};

/// One look at a region: the samples that lie below the depth, or may between two samples.
TouchingRegion looked_at(const PressedTip& tip, double depth_mm, const TouchingRegion& region) {
  const int n = kRegionSamples;
  const double dx = 2.0 * region.half_width_mm / n;
  const double dy = 2.0 * region.half_length_mm / n;
  const auto x = [&](int i) { return region.middle.x_mm - region.half_width_mm + (i + 0.5) * dx; };
  const auto y = [&](int j) { return region.middle.y_mm - region.half_length_mm + (j + 0.5) * dy; };
  std::vector<double> gap(static_cast<std::size_t>(n * n));
  const auto at = [&](int i, int j) {
    const bool inside = i >= 0 && j >= 0 && i < n && j < n;
    return inside ? gap[static_cast<std::size_t>(j * n + i)]
                  : std::numeric_limits<double>::infinity();
  };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) gap[static_cast<std::size_t>(j * n + i)] = tip.gap(x(i), y(j));
  }
  int left = n, right = -1, lower = n, upper = -1;
  double area = 0.0;
  double perimeter = 0.0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double here = at(i, j);
      double rise = 0.0;
      for (const double beside : {at(i - 1, j), at(i + 1, j), at(i, j - 1), at(i, j + 1)}) {
        if (std::isfinite(beside)) rise = std::max(rise, std::fabs(beside - here));
      }
      if (here <= depth_mm) {
        area += dx * dy;
        for (const double beside : {at(i - 1, j), at(i + 1, j)}) {
          if (beside > depth_mm) perimeter += 0.25 * std::numbers::pi * dy;
        }
        for (const double beside : {at(i, j - 1), at(i, j + 1)}) {
          if (beside > depth_mm) perimeter += 0.25 * std::numbers::pi * dx;
        }
      }
      if (!(here - rise <= kBulge * depth_mm)) continue;
      left = std::min(left, i);
      right = std::max(right, i);
      lower = std::min(lower, j);
      upper = std::max(upper, j);
    }
  }
  if (right < 0) return region;
  TouchingRegion found;
  const double x0 = x(std::max(0, left - 1)) - 0.5 * dx;
  const double x1 = x(std::min(n - 1, right + 1)) + 0.5 * dx;
  const double y0 = y(std::max(0, lower - 1)) - 0.5 * dy;
  const double y1 = y(std::min(n - 1, upper + 1)) + 0.5 * dy;
  found.middle = {0.5 * (x0 + x1), 0.5 * (y0 + y1)};
  found.half_width_mm = 0.5 * (x1 - x0);
  found.half_length_mm = 0.5 * (y1 - y0);
  found.part_mm = perimeter > 0.0 ? 4.0 * area / perimeter : 0.0;
  return found;
}

}  // namespace

std::size_t pixels_over(double half_mm, double pixel_mm) noexcept {
  return 2 * static_cast<std::size_t>(std::ceil(half_mm / pixel_mm - 1e-9)) + 1;
}

double finest_pixel_mm(double half_width_mm, double half_length_mm) noexcept {
  const double three_across = 6.0 * std::max(half_width_mm, half_length_mm) / kMaxPixels;
  return std::max(three_across, std::sqrt(4.0 * half_width_mm * half_length_mm / kMaxPixels));
}

ContactPixels contact_pixels(const PressedTip& tip, double depth_mm, double receptor_depth_mm) {
  TouchingRegion region{
      .middle = {}, .half_width_mm = tip.half_width_mm, .half_length_mm = tip.half_length_mm};
  for (int zoom = 0; zoom < kMaxZooms; ++zoom) {
    const TouchingRegion closer = looked_at(tip, depth_mm, region);
    const bool found = closer.half_width_mm > kZoomed * region.half_width_mm &&
                       closer.half_length_mm > kZoomed * region.half_length_mm;
    region = closer;
    if (found) break;
  }
  double pixel = std::min(tip.feature_mm / kPixelsPerFeature, tip.pixel_mm);
  if (std::isfinite(pixel)) pixel = std::min(pixel, receptor_depth_mm / kNodesPerDepth);
  if (region.part_mm > 0.0) pixel = std::min(pixel, region.part_mm / kPixelsPerPart);
  const double coarsest = kCoarsestPixel * receptor_depth_mm;
  pixel = std::min(pixel, coarsest);
  pixel = std::max(pixel, finest_pixel_mm(region.half_width_mm, region.half_length_mm));
  const auto grid = [&](double pixel_mm) {
    return PixelGrid{.pixel_mm = pixel_mm,
                     .columns = pixels_over(region.half_width_mm, pixel_mm),
                     .rows = pixels_over(region.half_length_mm, pixel_mm)};
  };
  const auto cost = [](const PixelGrid& pixels) {
    return padded_pixels(2 * pixels.columns - 1) * padded_pixels(2 * pixels.rows - 1);
  };
  // Slightly larger pixels, if they fit into smaller transforms.
  PixelGrid best = grid(pixel);
  for (const double larger : {1.1, 1.2, 1.3}) {
    if (larger * pixel > coarsest) break;
    if (cost(grid(larger * pixel)) < cost(best)) best = grid(larger * pixel);
  }
  return {.grid = best, .middle = region.middle};
}

}  // namespace merkel
