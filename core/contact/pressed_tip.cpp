#include "core/contact/pressed_tip.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace merkel {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Tables reach at most to this depth.
constexpr double kDeepestTable_mm = 4.0;
constexpr double kDeepestEllipse_mm = 3.0;
constexpr double kMinSamples = 240.0;  ///< of the gap, in each direction
constexpr double kMaxSamples = 1000.0;
constexpr int kValleys = 64;        ///< in which the lowest point is looked for
constexpr double kMinPixels = 5.0;  ///< across the smallest part

/// Half of the size of a tip before it is turned.
Position half_size(const Tip& tip) noexcept {
  return std::visit(
      [](const auto& each) -> Position {
        if constexpr (requires { each.half_size(); }) return each.half_size();
        return {kInfinite, kInfinite};
      },
      tip);
}

double radius_along(const Indenter& indenter, const SkinParameters& skin) {
  if (std::holds_alternative<BarTip>(indenter.tip) && skin.apex) return kInfinite;
  return skin.finger_along_mm();
}

}  // namespace

// The lowest point is found downhill from the lowest of the samples.
HeightRange heights_of(const TipHeight& gap, const Position& half, double pixel_mm) {
  const double half_x = half.x_mm;
  const double half_y = half.y_mm;
  // A size that is not a number takes the fewest.
  const double wanted = 2.0 * std::max(half_x, half_y) / pixel_mm;
  const int n =
      static_cast<int>(wanted > kMinSamples ? std::min(wanted, kMaxSamples) : kMinSamples);
  // The outermost samples lie just inside the tip.
  const auto x = [&](int i) { return 0.9999 * half_x * (2.0 * i / n - 1.0); };
  const auto y = [&](int j) { return 0.9999 * half_y * (2.0 * j / n - 1.0); };
  const auto width = static_cast<std::size_t>(n + 1);
  std::vector<double> samples(width * width);
  double highest = 0.0;
  for (std::size_t at = 0; at < samples.size(); ++at) {
    samples[at] = gap(x(static_cast<int>(at % width)), y(static_cast<int>(at / width)));
    if (std::isfinite(samples[at])) highest = std::max(highest, samples[at]);
  }
  double lowest = kInfinite;
  for (int valley = 0; valley < kValleys; ++valley) {
    const auto start = std::min_element(samples.begin(), samples.end());
    if (std::isinf(*start)) break;
    const auto at = static_cast<std::size_t>(start - samples.begin());
    Position best{x(static_cast<int>(at % width)), y(static_cast<int>(at / width))};
    double here = *start;
    for (double step = 2.0 / n; step > 1e-7; step *= 0.5) {
      for (const auto& [dx, dy] : {std::pair{-1.0, 0.0}, {1.0, 0.0}, {0.0, -1.0}, {0.0, 1.0}}) {
        const Position next{best.x_mm + dx * step * half_x, best.y_mm + dy * step * half_y};
        if (const double height = gap(next.x_mm, next.y_mm); height < here) {
          here = height;
          best = next;
        }
      }
    }
    lowest = std::min(lowest, here);
    // The next valley is elsewhere.
    for (std::size_t j = at / width - std::min<std::size_t>(at / width, 2);
         j < std::min(at / width + 3, width); ++j) {
      for (std::size_t i = at % width - std::min<std::size_t>(at % width, 2);
           i < std::min(at % width + 3, width); ++i) {
        samples[j * width + i] = kInfinite;
      }
    }
  }
  return {lowest, std::max(highest, lowest)};
}

double map_pixel_mm(const Indenter& indenter) noexcept {
  const auto* const shape = std::get_if<ShapeTip>(&indenter.tip);
  return shape != nullptr ? shape->map->grid.pixel_mm : kInfinite;
}

double feature_of(const Indenter& indenter) {
  return std::visit(
      [](const auto& tip) {
        if constexpr (requires { tip.feature_mm(); }) return tip.feature_mm();
        return kInfinite;
      },
      indenter.tip);
}

TipHeight height_of(const Indenter& indenter, const SkinParameters& skin) {
  if (const SphereTip* const sphere = indenter.sphere()) {
    return skin.contact_law == ContactLaw::kSneddon ? exact_sphere_height(sphere->radius_mm)
                                                    : sphere_height(sphere->radius_mm);
  }
  TipHeight upright = std::visit(
      [](const auto& tip) -> TipHeight {
        if constexpr (requires { tip.height(); }) return tip.height();
        return {};
      },
      indenter.tip);
  return turned(std::move(upright), indenter.orientation_deg, indenter.tilt_deg);
}

PressedTip pressed_tip(const Indenter& indenter, const SkinParameters& skin) {
  const double along = radius_along(indenter, skin);
  PressedTip tip{.gap = above_finger(height_of(indenter, skin), along, skin.radius_mm, {}),
                 .feature_mm = feature_of(indenter),
                 .pixel_mm = map_pixel_mm(indenter)};
  auto [half_x, half_y] = half_extent(indenter);
  if (const SphereTip* const sphere = indenter.sphere()) {
    // What lies below the deepest table.
    const auto reach = [&](double radius) {
      return std::sqrt(2.0 * kDeepestTable_mm / (1.0 / sphere->radius_mm + 1.0 / radius));
    };
    half_x = reach(along);
    half_y = reach(skin.radius_mm);
    if (skin.contact_law == ContactLaw::kSneddon) {
      half_x = std::min(half_x, sphere->radius_mm);
      half_y = std::min(half_y, sphere->radius_mm);
    }
  }
  const auto [lowest, highest] = heights_of(tip.gap, {half_x, half_y}, tip.pixel_mm);
  tip.gap = [gap = std::move(tip.gap), lowest = lowest](double x, double y) {
    return gap(x, y) - lowest;
  };
  const double height = highest - lowest;
  // Flat ends on flat skin touch as a whole at once.
  tip.proportional = height < 1e-9;
  tip.deepest_mm = tip.proportional ? 1.0 : kDeepestTable_mm;
  if (indenter.closed_form(skin)) {
    tip.deepest_mm = kDeepestEllipse_mm;
    const double curvature = 1.0 / indenter.sphere()->radius_mm;
    tip.ellipse.emplace(curvature + 1.0 / along, curvature + 1.0 / skin.radius_mm,
                        SkinMaterial(skin).reduced_modulus_kPa());
    tip.half_width_mm = tip.ellipse->half_x() * std::sqrt(tip.deepest_mm);
    tip.half_length_mm = tip.ellipse->half_y() * std::sqrt(tip.deepest_mm);
    return tip;
  }
  tip.half_width_mm = half_x;
  tip.half_length_mm = half_y;
  const ContactPixels largest = contact_pixels(tip, tip.deepest_mm, skin.receptor_depth_mm);
  const auto& grid = largest.grid;
  tip.half_width_mm = std::min(half_x, std::fabs(largest.middle.x_mm) +
                                           0.5 * grid.pixel_mm * static_cast<double>(grid.columns));
  tip.half_length_mm = std::min(half_y, std::fabs(largest.middle.y_mm) +
                                            0.5 * grid.pixel_mm * static_cast<double>(grid.rows));
  return tip;
}

Position half_extent(const Indenter& indenter) noexcept {
  const auto [x, y] = half_size(indenter.tip);
  if (std::isinf(x)) return {x, y};
  const double angle = indenter.orientation_deg * std::numbers::pi / 180.0;
  const double c = std::fabs(std::cos(angle));
  const double s = std::fabs(std::sin(angle));
  return {c * x + s * y, s * x + c * y};
}

bool fits(const PressedTip& tip, double receptor_depth_mm) {
  const double pixel_mm = contact_pixels(tip, tip.deepest_mm, receptor_depth_mm).grid.pixel_mm;
  return kMinPixels * pixel_mm <= tip.feature_mm && pixel_mm <= kCoarsestPixel * receptor_depth_mm;
}

}  // namespace merkel
