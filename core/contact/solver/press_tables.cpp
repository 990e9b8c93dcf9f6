#include "core/contact/solver/press_tables.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

constexpr double kPixelsPerFeature = 6.0;
constexpr double kPixelsPerDepth = 8.0;
constexpr double kMostPixels = 65536.0;
constexpr double kFinestPixel_mm = 0.01;
/// Nodes are this many per receptor depth, or fewer.
constexpr double kNodesPerDepth = 8.0;
constexpr RigidContact::Accuracy kTableAccuracy{.tolerance = 1e-4, .most_iterations = 200};

/// Pixels on both sides of a middle, so that they cover a half width.
std::size_t pixels_over(double half_mm, double pixel_mm) {
  return 2 * static_cast<std::size_t>(std::ceil(half_mm / pixel_mm)) + 1;
}

}  // namespace

PixelGrid contact_pixels(const PressedTip& tip, double receptor_depth_mm) {
  double pixel = std::min(tip.feature_mm / kPixelsPerFeature, receptor_depth_mm / kPixelsPerDepth);
  pixel = std::max(pixel, kFinestPixel_mm);
  pixel = std::max(pixel, std::sqrt(4.0 * tip.half_width_mm * tip.half_length_mm / kMostPixels));
  return {.pixel_mm = pixel,
          .columns = pixels_over(tip.half_width_mm, pixel),
          .rows = pixels_over(tip.half_length_mm, pixel)};
}

PressTables press_tables(const PressedTip& tip, const LayeredMedium& medium,
                         double receptor_depth_mm, double deepest_mm, std::size_t count,
                         double margin_mm) {
  const PixelGrid contact = contact_pixels(tip, receptor_depth_mm);
  const double pixel = contact.pixel_mm;
  const auto stride = static_cast<std::size_t>(
      std::max(1.0, std::floor(receptor_depth_mm / kNodesPerDepth / pixel + 1e-9)));
  // The nodes are every `stride`-th pixel of a window around the same middle.
  const auto nodes = [&](std::size_t pixels) {
    const double half = 0.5 * static_cast<double>(pixels) * pixel + margin_mm;
    return pixels_over(half, pixel * static_cast<double>(stride));
  };
  PressTables press{.grid = {.pixel_mm = pixel * static_cast<double>(stride),
                             .columns = nodes(contact.columns),
                             .rows = nodes(contact.rows)},
                    .tables = std::vector<PressTables::Table>(count + 1)};
  const PixelGrid window{.pixel_mm = pixel,
                         .columns = (press.grid.columns - 1) * stride + 1,
                         .rows = (press.grid.rows - 1) * stride + 1};

  PixelKernels kernels(medium, receptor_depth_mm, contact, window);
  std::vector<GridSpectrum> fields;
  for (std::size_t f = 0; f < kPixelFields; ++f) {
    fields.push_back(kernels.kernel(static_cast<PixelField>(f)));
  }
  GridSpectrum pressure = kernels.transform().make_spectrum();
  std::vector<double> image(window.pixels());
  RigidContact solver(medium, height_map(tip.gap, contact));
  press.tables.front().nodes.assign(press.grid.pixels(), GridNode{});
  for (std::size_t k = 1; k <= count; ++k) {
    const double part = static_cast<double>(k) / static_cast<double>(count);
    PressTables::Table& table = press.tables[k];
    table.depth_mm = part * part * deepest_mm;
    const RigidContact::Solution solution = solver.press(table.depth_mm, kTableAccuracy);
    table.force_mN_per_mm = solution.force_mN / table.depth_mm;
    table.nodes.resize(press.grid.pixels());
    kernels.transform().forward(solver.pressure_kPa(), contact.columns, contact.rows, pressure);
    for (std::size_t f = 0; f < kPixelFields; ++f) {
      kernels.transform().convolve(pressure, fields[f], window.columns, window.rows, image);
      for (std::size_t row = 0; row < press.grid.rows; ++row) {
        for (std::size_t column = 0; column < press.grid.columns; ++column) {
          table.nodes[row * press.grid.columns + column].values[f] =
              image[row * stride * window.columns + column * stride] / table.depth_mm;
        }
      }
    }
  }
  return press;
}

}  // namespace merkel
