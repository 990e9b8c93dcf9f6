#include "core/contact/pressed_tip.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace merkel {
namespace {

using Tip = Indenter::Tip;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Tables reach at most to this depth.
constexpr double kDeepestTable_mm = 4.0;
constexpr double kDeepestEllipse_mm = 3.0;
/// Shapes with parts of different heights are solved at least to this depth.
constexpr double kLeastDeepest_mm = 2.0;
/// A smooth end touches as a whole when pressed twice as deep as it is high.
constexpr double kWholeContact = 2.5;
constexpr int kSamples = 240;  ///< of the gap, in each direction
/// Incompressible layers bulge into contact beside the part that lies below the depth.
constexpr double kBulge = 1.1;
constexpr double kEllipseMargin = 0.25;  ///< in depths of the receptors
constexpr double kFewestPixels = 5.0;    ///< across the smallest part
constexpr double kCoarsestPixel = 0.5;   ///< in depths of the receptors

/// Half of the size of a tip before it is turned.
std::pair<double, double> half_size(const Indenter& indenter) noexcept {
  const TipShape& shape = indenter.shape;
  const double round = 0.5 * indenter.pin.diameter_mm;
  switch (indenter.tip) {
    case Tip::kSphere:
      return {kInfinite, kInfinite};
    case Tip::kBars:
      return {0.5 * indenter.bars.total_width_mm(), 0.5 * indenter.bars.length_mm};
    case Tip::kPin:
    case Tip::kCone:
      return {round, round};
    case Tip::kEdge:
    case Tip::kWedge:
      return {0.5 * shape.width_mm, 0.5 * shape.length_mm};
    case Tip::kCylinder:
      return {indenter.radius_mm, 0.5 * shape.length_mm};
    case Tip::kDots: {
      std::pair<double, double> most{0.0, 0.0};
      for (const Position& dot : shape.dots) {
        most = {std::max(most.first, std::fabs(dot.x_mm)),
                std::max(most.second, std::fabs(dot.y_mm))};
      }
      return {most.first + round, most.second + round};
    }
    case Tip::kShape:
      return {0.5 * shape.map->grid.pixel_mm * static_cast<double>(shape.map->grid.columns),
              0.5 * shape.map->grid.pixel_mm * static_cast<double>(shape.map->grid.rows)};
    case Tip::kTaxels:  // no contact is solved
      break;
  }
  return {};
}

TipHeight upright_height(const Indenter& indenter, const SkinParameters& skin) {
  const TipShape& shape = indenter.shape;
  const double rim = shape.edge_radius_mm;
  switch (indenter.tip) {
    case Tip::kSphere:
      return skin.contact_law == ContactLaw::kSneddon ? exact_sphere_height(indenter.radius_mm)
                                                      : sphere_height(indenter.radius_mm);
    case Tip::kBars: {
      std::vector<FlatRectangle> ends;
      for (std::size_t i = 0; i < indenter.bars.widths_mm.size(); ++i) {
        ends.push_back({.x_mm = indenter.bars.centre_mm(i),
                        .y_mm = 0.0,
                        .width_mm = indenter.bars.widths_mm[i],
                        .length_mm = indenter.bars.length_mm});
      }
      return rectangles_height(std::move(ends), rim);
    }
    case Tip::kPin:
      return pin_height(indenter.pin.diameter_mm, rim);
    case Tip::kEdge:
      return rectangles_height({{0.0, 0.0, shape.width_mm, shape.length_mm}}, rim);
    case Tip::kWedge:
      return wedge_height(shape.angle_deg, shape.length_mm, rim);
    case Tip::kCone:
      return cone_height(shape.angle_deg, rim);
    case Tip::kCylinder:
      return cylinder_height(indenter.radius_mm, shape.length_mm);
    case Tip::kDots:
      return dots_height(shape.dots, indenter.pin.diameter_mm, rim);
    case Tip::kShape:
      return map_height(*shape.map);
    case Tip::kTaxels:
      break;
  }
  return {};
}

double radius_along(const Indenter& indenter, const SkinParameters& skin) {
  if (indenter.tip == Tip::kBars && skin.apex) return kInfinite;
  return skin.finger_along_mm();
}

/// The highest point of the gap, and how far the part below a depth reaches.
struct Reach {
  double lowest_mm = kInfinite;
  double highest_mm = 0.0;  ///< of what is within a size
  double half_width_mm = 0.0;
  double half_length_mm = 0.0;
};
Reach reach_of(const TipHeight& gap, double half_x, double half_y, double depth_mm) {
  Reach reach;
  const auto visit = [&](auto what) {
    for (int j = 0; j <= kSamples; ++j) {
      for (int i = 0; i <= kSamples; ++i) {
        // The outermost samples lie just inside the tip.
        const double x = 0.9999 * half_x * (2.0 * i / kSamples - 1.0);
        const double y = 0.9999 * half_y * (2.0 * j / kSamples - 1.0);
        if (const double height = gap(x, y); std::isfinite(height)) what(x, y, height);
      }
    }
  };
  visit([&](double, double, double height) {
    reach.lowest_mm = std::min(reach.lowest_mm, height);
    reach.highest_mm = std::max(reach.highest_mm, height);
  });
  visit([&](double x, double y, double height) {
    if (height - reach.lowest_mm > depth_mm) return;
    reach.half_width_mm = std::max(reach.half_width_mm, std::fabs(x));
    reach.half_length_mm = std::max(reach.half_length_mm, std::fabs(y));
  });
  return reach;
}

}  // namespace

double feature_of(const Indenter& indenter) {
  switch (indenter.tip) {
    case Tip::kBars: {
      const BarTip& bars = indenter.bars;
      double least = bars.length_mm;
      for (const double width : bars.widths_mm) least = std::min(least, width);
      for (const double gap : bars.gaps_mm) least = std::min(least, gap);
      return least;
    }
    case Tip::kPin:
    case Tip::kDots:
      return indenter.pin.diameter_mm;
    case Tip::kEdge:
      return std::min(indenter.shape.width_mm, indenter.shape.length_mm);
    default:
      return kInfinite;
  }
}

TipHeight height_of(const Indenter& indenter, const SkinParameters& skin) {
  TipHeight upright = upright_height(indenter, skin);
  if (indenter.tip == Tip::kSphere) return upright;
  const auto [half_x, half_y] = half_size(indenter);
  const bool round = indenter.tip == Tip::kCone;
  TipHeight ended = [=, half_x = half_x, half_y = half_y, tip = std::move(upright)](double x,
                                                                                    double y) {
    const bool inside =
        round ? std::hypot(x, y) <= half_x : std::fabs(x) <= half_x && std::fabs(y) <= half_y;
    return inside ? tip(x, y) : kInfinite;
  };
  return turned(std::move(ended), indenter.shape.orientation_deg, indenter.shape.tilt_deg);
}

PressedTip pressed_tip(const Indenter& indenter, const SkinParameters& skin) {
  const double along = radius_along(indenter, skin);
  PressedTip tip{.gap = above_finger(height_of(indenter, skin), along, skin.radius_mm, {}),
                 .feature_mm = feature_of(indenter)};
  auto [half_x, half_y] = half_size(indenter);
  if (indenter.tip == Tip::kSphere) {
    // What lies below the deepest table.
    const auto reach = [&](double radius) {
      return std::sqrt(2.0 * kDeepestTable_mm / (1.0 / indenter.radius_mm + 1.0 / radius));
    };
    half_x = reach(along);
    half_y = reach(skin.radius_mm);
    if (skin.contact_law == ContactLaw::kSneddon) {
      half_x = std::min(half_x, indenter.radius_mm);
      half_y = std::min(half_y, indenter.radius_mm);
    }
  } else {
    const Position half = half_extent(indenter);
    half_x = half.x_mm;
    half_y = half.y_mm;
  }
  const Reach whole = reach_of(tip.gap, half_x, half_y, kInfinite);
  const double height = whole.highest_mm - whole.lowest_mm;
  // Flat ends on flat skin touch as a whole at once.
  tip.proportional = height < 1e-9;
  tip.deepest_mm = tip.proportional ? 1.0 : std::min(kWholeContact * height, kDeepestTable_mm);
  if (!tip.proportional && (indenter.tip == Tip::kShape || indenter.tip == Tip::kDots)) {
    tip.deepest_mm = std::max(tip.deepest_mm, kLeastDeepest_mm);
  }
  if (indenter.closed_form(skin)) {
    tip.deepest_mm = kDeepestEllipse_mm;
    tip.ellipse.emplace(1.0 / indenter.radius_mm + 1.0 / along,
                        1.0 / indenter.radius_mm + 1.0 / skin.radius_mm,
                        SkinMaterial(skin).reduced_modulus_kPa());
    // The sharpened pressures extend by a pixel.
    const double margin = kEllipseMargin * skin.receptor_depth_mm;
    tip.half_width_mm = tip.ellipse->half_x() * std::sqrt(tip.deepest_mm) + margin;
    tip.half_length_mm = tip.ellipse->half_y() * std::sqrt(tip.deepest_mm) + margin;
    return tip;
  }
  const Reach reach = reach_of(tip.gap, half_x, half_y, kBulge * tip.deepest_mm);
  tip.half_width_mm = std::min(half_x, kBulge * reach.half_width_mm);
  tip.half_length_mm = std::min(half_y, kBulge * reach.half_length_mm);
  if (indenter.tip == Tip::kPin) tip.largest_area_mm2 = std::numbers::pi * half_x * half_x;
  return tip;
}

Position half_extent(const Indenter& indenter) noexcept {
  const auto [x, y] = half_size(indenter);
  if (std::isinf(x)) return {x, y};
  const double angle = indenter.shape.orientation_deg * std::numbers::pi / 180.0;
  const double c = std::fabs(std::cos(angle));
  const double s = std::fabs(std::sin(angle));
  return {c * x + s * y, s * x + c * y};
}

double across_mm(const Indenter& indenter) noexcept {
  const auto [half_x, half_y] = half_size(indenter);
  const bool round = indenter.tip == Tip::kPin || indenter.tip == Tip::kCone;
  return 2.0 * (round ? half_x : std::hypot(half_x, half_y));
}

bool fits(const PressedTip& tip, double receptor_depth_mm) noexcept {
  const double pixel_mm = contact_pixels(tip, receptor_depth_mm).pixel_mm;
  return kFewestPixels * pixel_mm <= tip.feature_mm &&
         pixel_mm <= kCoarsestPixel * receptor_depth_mm;
}

}  // namespace merkel
