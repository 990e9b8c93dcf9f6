#include "core/contact/solver/press_tables.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace merkel {
namespace {

constexpr double kPixelsPerFeature = 12.0;
constexpr double kPixelsPerDepth = 6.0;
constexpr double kMostPixels = 65536.0;
constexpr double kFinestPixel_mm = 0.01;
constexpr double kNodesPerDepth = 6.0;
constexpr double kLeastMargin_mm = 6.0;
constexpr double kMostMargin_mm = 10.0;
constexpr double kMostMarginPixels = 150.0;  ///< where pixels are fine, a smaller margin
constexpr RigidContact::Accuracy kTableAccuracy{.tolerance = 5e-4, .most_iterations = 300};

/// Pixels on both sides of a middle, so that they cover a half width.
std::size_t pixels_over(double half_mm, double pixel_mm) {
  return 2 * static_cast<std::size_t>(std::ceil(half_mm / pixel_mm)) + 1;
}

/// Nodes, each `stride` pixels apart, over a contact and its margin: as many as fill the transform
/// that the least margin needs.
std::size_t nodes_around(std::size_t contact, std::size_t stride, double pixel_mm) {
  const double half_mm = 0.5 * static_cast<double>(contact) * pixel_mm;
  const double step_mm = pixel_mm * static_cast<double>(stride);
  const auto window = [&](std::size_t nodes) { return (nodes - 1) * stride + 1; };
  const double finest_mm = kMostMarginPixels * pixel_mm;
  std::size_t nodes = pixels_over(half_mm + std::min(kLeastMargin_mm, finest_mm), step_mm);
  const std::size_t most = pixels_over(half_mm + kMostMargin_mm, step_mm);
  const std::size_t room = padded_pixels(contact + window(nodes) - 1);
  while (nodes + 2 <= most && contact + window(nodes + 2) - 1 <= room) nodes += 2;
  return nodes;
}

/// The elliptic contact at a table's depth.
void touch(const HertzEllipse& ellipse, PressTables::Table& table, PressTables& press) {
  const double root = std::sqrt(table.depth_mm);
  ellipse.fill(table.depth_mm, press.contact, press.pressure_kPa);
  table.force_mN_per_mm = ellipse.force() * root;
  table.area_mm2 = std::numbers::pi * ellipse.half_x() * ellipse.half_y() * table.depth_mm;
  table.peak_pressure_kPa = ellipse.peak_pressure() * root;
}

void solve(RigidContact& solver, const PressedTip& tip, PressTables::Table& table,
           PressTables& press) {
  const RigidContact::Solution solution = solver.press(table.depth_mm, kTableAccuracy);
  press.iterations += solution.iterations;
  press.error = std::max(press.error, solution.error);
  table.force_mN_per_mm = solution.force_mN / table.depth_mm;
  table.area_mm2 = std::min(solution.area_mm2, tip.largest_area_mm2);
  table.peak_pressure_kPa = solution.peak_pressure_kPa;
  press.pressure_kPa.assign(solver.pressure_kPa().begin(), solver.pressure_kPa().end());
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
                         double receptor_depth_mm, std::size_t count) {
  const PixelGrid contact = contact_pixels(tip, receptor_depth_mm);
  const double pixel = contact.pixel_mm;
  const auto stride = static_cast<std::size_t>(
      std::max(1.0, std::floor(receptor_depth_mm / kNodesPerDepth / pixel + 1e-9)));
  PressTables press{.grid = {.pixel_mm = pixel * static_cast<double>(stride),
                             .columns = nodes_around(contact.columns, stride, pixel),
                             .rows = nodes_around(contact.rows, stride, pixel)},
                    .tables = std::vector<PressTables::Table>(count + 1),
                    .contact = contact};
  const PixelGrid window{.pixel_mm = pixel,
                         .columns = (press.grid.columns - 1) * stride + 1,
                         .rows = (press.grid.rows - 1) * stride + 1};

  PixelKernels kernels(medium, receptor_depth_mm, contact, window);
  std::vector<GridSpectrum> fields;
  for (std::size_t f = 0; f < kPixelFields; ++f) {
    fields.push_back(kernels.kernel(static_cast<PixelField>(f)));
  }
  GridSpectrum spectrum = kernels.transform().make_spectrum();
  std::vector<double> image(window.pixels());
  std::optional<RigidContact> solver;
  if (!tip.ellipse) solver.emplace(medium, height_map(tip.gap, contact));
  press.tables.front().nodes.assign(press.grid.pixels(), GridNode{});
  press.pressure_kPa.resize(contact.pixels());
  for (std::size_t k = 1; k <= count; ++k) {
    const double part = static_cast<double>(k) / static_cast<double>(count);
    PressTables::Table& table = press.tables[k];
    table.depth_mm = part * part * tip.deepest_mm * (tip.ellipse ? std::sqrt(part) : 1.0);
    if (tip.ellipse) {
      touch(*tip.ellipse, table, press);
    } else {
      solve(*solver, tip, table, press);
    }
    table.nodes.resize(press.grid.pixels());
    kernels.transform().forward(press.pressure_kPa, contact.columns, contact.rows, spectrum);
    for (std::size_t f = 0; f < kPixelFields; ++f) {
      kernels.transform().convolve(spectrum, fields[f], window.columns, window.rows, image);
      for (std::size_t row = 0; row < press.grid.rows; ++row) {
        for (std::size_t column = 0; column < press.grid.columns; ++column) {
          table.nodes[row * press.grid.columns + column].values[f] = static_cast<float>(
              image[row * stride * window.columns + column * stride] / table.depth_mm);
        }
      }
    }
  }
  return press;
}

}  // namespace merkel
