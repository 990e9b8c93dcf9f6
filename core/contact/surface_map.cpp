#include "core/contact/surface_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

#include "core/contact/pressed_tip.hpp"
#include "core/contact/solver/rim_pixels.hpp"

namespace merkel {
namespace {

/// Half of the contact with a plate is √(Rd); parts that rise from a surface touch farther out.
constexpr double kContactReach = 1.2;
constexpr double kWindowMargin_mm = 2.5;
constexpr double kFinestOfDepth = 0.25;
constexpr double kCoarsestOfDepth = 0.4;
constexpr double kFinestOfFeature = 1.0 / 6.0;
constexpr double kCoarsestOfFeature = 0.25;
/// Rims are sharpened for this depth, in depths of the room that a contact has.
constexpr double kRimDepth = 0.7;
/// Transforms of this size are the unit of cost: three parts of a solution take at most 0.6 ms.
constexpr double kUnitPixels = 128.0 * 128.0;
constexpr double kPartsPer_ms = 3.0;
/// A part of larger transforms would take longer than a tick.
constexpr double kMaxCostPer_ms = 5.0;

double cost_of(double pixels) {
  return pixels * std::log2(pixels) / (kUnitPixels * std::log2(kUnitPixels));
}

/// The largest length that both periods are multiples of, to 1 µm; 0: the surface does not repeat.
double common_period_mm(const SlidingSurface& surface) {
  const auto um = [](double mm) { return static_cast<std::int64_t>(std::llround(1e3 * mm)); };
  return 1e-3 * static_cast<double>(std::gcd(um(surface.period_x_mm), um(surface.period_y_mm)));
}

/// The pixel closest to a wanted one of which the periods are multiples.
double fitted_pixel_mm(double wanted_mm, double coarsest_mm, double period_mm) {
  if (period_mm == 0.0) return wanted_mm;
  const double pixels = std::max(1.0, std::floor(period_mm / wanted_mm));
  return period_mm / pixels <= coarsest_mm ? period_mm / pixels
                                           : period_mm / std::ceil(period_mm / wanted_mm);
}

std::size_t pixels_across(double half_mm, double pixel_mm) {
  return 2 * static_cast<std::size_t>(std::ceil(half_mm / pixel_mm)) + 1;
}

/// The parts of a surface and their images, above its base.
TipHeight repeated(TipHeight part, const SlidingSurface& surface) {
  return [=, part = std::move(part)](double x, double y) {
    const auto images = [](double period) { return period > 0.0 ? 1 : 0; };
    const auto inside = [](double at, double period) {
      return period > 0.0 ? at - period * std::round(at / period) : at;
    };
    double lowest = surface.relief_mm;
    for (int j = -images(surface.period_y_mm); j <= images(surface.period_y_mm); ++j) {
      for (int i = -images(surface.period_x_mm); i <= images(surface.period_x_mm); ++i) {
        lowest = std::min(lowest, part(inside(x, surface.period_x_mm) + i * surface.period_x_mm,
                                       inside(y, surface.period_y_mm) + j * surface.period_y_mm));
      }
    }
    return lowest;
  };
}

/// Columns or rows of the map.
std::size_t pixels_of(double period_mm, double half_mm, double pixel_mm) {
  if (period_mm > 0.0) return static_cast<std::size_t>(std::lround(period_mm / pixel_mm));
  return pixels_across(half_mm, pixel_mm) + 2;
}

std::optional<std::size_t> wrapped(std::ptrdiff_t at, std::size_t count, bool repeats) noexcept {
  const auto n = static_cast<std::ptrdiff_t>(count);
  if (repeats) return static_cast<std::size_t>(((at % n) + n) % n);
  if (at < 0 || at >= n) return std::nullopt;
  return static_cast<std::size_t>(at);
}

}  // namespace

std::optional<SlidingPlan> SlidingPlan::of(const Indenter& surface, const SkinParameters& skin,
                                           std::chrono::nanoseconds tick) {
  const double tick_ms = 1e-6 * static_cast<double>(tick.count());
  const double feature = feature_of(surface);
  const double z = skin.receptor_depth_mm;
  const double finest = std::min(kFinestOfDepth * z, kFinestOfFeature * feature);
  const double coarsest = std::min(kCoarsestOfDepth * z, kCoarsestOfFeature * feature);
  const double period = common_period_mm(surface.surface);
  const auto half = [&](double radius) {
    return kContactReach * std::sqrt(radius * surface.surface.deepest_mm);
  };
  const auto plan_with = [&](double wanted_mm) {
    SlidingPlan plan;
    const double pixel = fitted_pixel_mm(wanted_mm, coarsest, period);
    const std::size_t margin = 2 * static_cast<std::size_t>(std::ceil(kWindowMargin_mm / pixel));
    plan.contact = {.pixel_mm = pixel,
                    .columns = pixels_across(half(skin.finger_along_mm()), pixel),
                    .rows = pixels_across(half(skin.radius_mm), pixel)};
    plan.window = {.pixel_mm = pixel,
                   .columns = plan.contact.columns + margin,
                   .rows = plan.contact.rows + margin};
    const double cost =
        cost_of(static_cast<double>(padded_pixels(plan.contact.columns + plan.window.columns - 1)) *
                static_cast<double>(padded_pixels(plan.contact.rows + plan.window.rows - 1)));
    return std::pair(plan, cost);
  };
  auto [plan, cost] = plan_with(finest);
  for (double wanted = finest; cost > 1.0 && wanted < coarsest; wanted *= 1.02) {
    std::tie(plan, cost) = plan_with(std::min(wanted, coarsest));
  }
  if (cost > kMaxCostPer_ms * tick_ms || plan.contact.pixel_mm > 1.001 * coarsest) {
    return std::nullopt;
  }
  // In whole milliseconds, so that finer ticks have the same lag.
  const double parts_per_ms =
      std::clamp(std::floor(kPartsPer_ms / cost), 1.0, static_cast<double>(kParts));
  const double interval_ms = std::ceil(kParts / parts_per_ms);
  plan.ticks = std::max(1, static_cast<int>(std::ceil(interval_ms / tick_ms - 1e-9)));
  plan.parts_per_tick = (kParts + plan.ticks - 1) / plan.ticks;
  return plan;
}

SurfaceMap::SurfaceMap(const Indenter& surface, const SkinParameters& skin, double pixel_mm)
    : base_mm_(surface.surface.relief_mm),
      repeats_x_(surface.surface.period_x_mm > 0.0),
      repeats_y_(surface.surface.period_y_mm > 0.0) {
  if (surface.sphere() != nullptr) {  // a plate
    map_ = {.grid = {.pixel_mm = pixel_mm, .columns = 1, .rows = 1},
            .height_mm = {0.0},
            .coverage = {1.0}};
    base_mm_ = 0.0;
    return;
  }
  const Position half = half_extent(surface);
  const PixelGrid grid{.pixel_mm = pixel_mm,
                       .columns = pixels_of(surface.surface.period_x_mm, half.x_mm, pixel_mm),
                       .rows = pixels_of(surface.surface.period_y_mm, half.y_mm, pixel_mm)};
  const TipHeight part = height_of(surface, skin);
  const double lowest_mm = heights_of(part, half, map_pixel_mm(surface)).lowest_mm;
  const TipHeight tip = [=, own = repeated(part, surface.surface)](double x, double y) {
    return own(x, y) - lowest_mm;
  };
  map_ = height_map(tip, grid);
  if (std::isfinite(base_mm_)) {
    base_mm_ = *std::max_element(map_.height_mm.begin(), map_.height_mm.end());
  }
  // The neighbours of a period press as well.
  PixelGrid around = grid;
  if (repeats_x_) around.columns *= 3;
  if (repeats_y_) around.rows *= 3;
  HeightMap sharpened = height_map(tip, around);
  sharpen_rims(tip, LayeredMedium(skin), kRimDepth * surface.surface.deepest_mm, sharpened);
  if (!sharpened.rims.empty()) {
    const std::size_t column = (around.columns - grid.columns) / 2;
    const std::size_t row = (around.rows - grid.rows) / 2;
    HeightMap middle{.grid = grid, .height_mm = {}, .coverage = {}};
    for (std::size_t j = 0; j < grid.rows; ++j) {
      const auto first = static_cast<std::ptrdiff_t>((row + j) * around.columns + column);
      const auto last = first + static_cast<std::ptrdiff_t>(grid.columns);
      const auto append = [&](const auto& from, auto& to) {
        to.insert(to.end(), from.begin() + first, from.begin() + last);
      };
      append(sharpened.height_mm, middle.height_mm);
      append(sharpened.coverage, middle.coverage);
      append(sharpened.rims, middle.rims);
    }
    map_ = std::move(middle);
  }
}

double SurfaceMap::x_mm(std::ptrdiff_t column) const noexcept {
  return (static_cast<double>(column) - 0.5 * static_cast<double>(map_.grid.columns - 1)) *
         map_.grid.pixel_mm;
}

double SurfaceMap::y_mm(std::ptrdiff_t row) const noexcept {
  return (static_cast<double>(row) - 0.5 * static_cast<double>(map_.grid.rows - 1)) *
         map_.grid.pixel_mm;
}

std::ptrdiff_t SurfaceMap::column_at(double x_mm) const noexcept {
  return static_cast<std::ptrdiff_t>(std::floor(place_x(x_mm) + 0.5));
}

std::ptrdiff_t SurfaceMap::row_at(double y_mm) const noexcept {
  return static_cast<std::ptrdiff_t>(std::floor(place_y(y_mm) + 0.5));
}

void SurfaceMap::copy(std::ptrdiff_t first_column, std::ptrdiff_t first_row,
                      HeightMap& to) const noexcept {
  const bool base = std::isfinite(base_mm_);
  for (std::size_t row = 0; row < to.grid.rows; ++row) {
    const auto j =
        wrapped(first_row + static_cast<std::ptrdiff_t>(row), map_.grid.rows, repeats_y_);
    for (std::size_t column = 0; column < to.grid.columns; ++column) {
      const auto i = wrapped(first_column + static_cast<std::ptrdiff_t>(column), map_.grid.columns,
                             repeats_x_);
      const std::size_t at = row * to.grid.columns + column;
      if (i && j) {
        to.height_mm[at] = map_.height_mm[*j * map_.grid.columns + *i];
        to.coverage[at] = map_.coverage[*j * map_.grid.columns + *i];
        if (!map_.rims.empty()) to.rims[at] = map_.rims[*j * map_.grid.columns + *i];
      } else {
        to.height_mm[at] = base_mm_;
        to.coverage[at] = base ? 1.0 : 0.0;
        to.rims[at] = {};
      }
    }
  }
}

bool SurfaceMap::contains(double x_mm, double y_mm) const noexcept {
  return std::isfinite(base_mm_) || (wrapped(column_at(x_mm), map_.grid.columns, repeats_x_) &&
                                     wrapped(row_at(y_mm), map_.grid.rows, repeats_y_));
}

}  // namespace merkel
