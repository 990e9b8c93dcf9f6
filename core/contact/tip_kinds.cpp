#include "core/contact/tip_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace merkel {
namespace {

// Keys that several tips have.
template <class T>
constexpr Field kDiameterKey{"diameter_mm", "mm", positive(100.0),
                             "diameter of a flat round pin, of each dot, or of the base of a cone",
                             at<&T::diameter_mm>};
template <class T>
constexpr Field kRadiusKey{
    "radius_mm", "mm", positive_or_infinite(1e6),
    "radius of a sphere or cylinder; inf is a flat plate, on a curved finger only",
    at<&T::radius_mm>};
template <class T>
constexpr Field kWidthKey{"width_mm", "mm", positive(100.0),
                          "width of an edge or of the base of a wedge, along x", at<&T::width_mm>};
template <class T>
constexpr Field kLengthKey{"length_mm", "mm", positive(100.0),
                           "length of an edge, wedge or cylinder, along y", at<&T::length_mm>};
template <class T>
constexpr Field kAngleKey{"angle_deg", "°", from_to(10.0, 178.0),
                          "angle between the faces of a wedge or cone", at<&T::angle_deg>};
template <class T>
constexpr Field kEdgeRadiusKey{
    "edge_radius_mm", "mm", not_negative(100.0),
    "rounds the rims of flat ends, the ridge of a wedge and the apex of a cone; 0: sharp",
    at<&T::edge_radius_mm>};

}  // namespace

Tip default_tip(std::size_t kind) {
  Tip tip;
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (void)((kind == I && (tip.emplace<I>(), true)) || ...);
  }
  (std::make_index_sequence<std::variant_size_v<Tip>>());
  return tip;
}

// Sphere

FieldTable SphereTip::fields() {
  static constexpr Field kFields[] = {kRadiusKey<SphereTip>};
  return {"probe", kFields};
}

void SphereTip::check(const SkinParameters& skin, ParameterCheck& all) const {
  all.require(std::isfinite(radius_mm) || std::isfinite(skin.radius_mm), "probe.radius_mm",
              "may be inf (a flat plate) only on a curved finger: set skin.radius_mm");
}

// Bars

FieldTable BarTip::fields() {
  using T = BarTip;
  static constexpr Field kFields[] = {
      {"bar_widths_mm", "mm", positive(100.0), "width of each bar, along x", at<&T::widths_mm>},
      {"bar_gaps_mm", "mm", positive(100.0), "gap between neighbouring bars, one fewer than bars",
       at<&T::gaps_mm>},
      {"bar_length_mm", "mm", positive(1e3), "length of the bars, along y", at<&T::length_mm>},
      kEdgeRadiusKey<T>};
  return {"probe", kFields};
}

void BarTip::check(const SkinParameters& /*skin*/, ParameterCheck& all) const {
  all.require(!widths_mm.empty() && widths_mm.size() <= kMaxBars, "probe.bar_widths_mm",
              "must list from 1 to 40 widths")
      .require(gaps_mm.size() + 1 == std::max<std::size_t>(widths_mm.size(), 1),
               "probe.bar_gaps_mm", "must list one gap fewer than there are bars");
  for (const double gap : gaps_mm) {
    all.require(gap > 0.0 && std::isfinite(gap), "probe.bar_gaps_mm",
                "must be positive: merge bars that touch or overlap, or widen the gap");
  }
}

double BarTip::total_width_mm() const noexcept {
  return std::accumulate(widths_mm.begin(), widths_mm.end(), 0.0) +
         std::accumulate(gaps_mm.begin(), gaps_mm.end(), 0.0);
}

double BarTip::centre_mm(std::size_t bar) const noexcept {
  double x = -0.5 * total_width_mm();
  for (std::size_t i = 0; i < bar; ++i) x += widths_mm[i] + gaps_mm[i];
  return x + 0.5 * widths_mm[bar];
}

TipHeight BarTip::height() const {
  std::vector<FlatRectangle> ends;
  for (std::size_t i = 0; i < widths_mm.size(); ++i) {
    ends.push_back({centre_mm(i), 0.0, widths_mm[i], length_mm});
  }
  return rectangles_height(std::move(ends), edge_radius_mm);
}

double BarTip::feature_mm() const noexcept {
  double least = length_mm;
  for (const double width : widths_mm) least = std::min(least, width);
  for (const double gap : gaps_mm) least = std::min(least, gap);
  return least;
}

// Pin

FieldTable PinTip::fields() {
  static constexpr Field kFields[] = {kDiameterKey<PinTip>, kEdgeRadiusKey<PinTip>};
  return {"probe", kFields};
}

// Edge

FieldTable EdgeTip::fields() {
  static constexpr Field kFields[] = {kWidthKey<EdgeTip>, kLengthKey<EdgeTip>,
                                      kEdgeRadiusKey<EdgeTip>};
  return {"probe", kFields};
}

// Wedge

FieldTable WedgeTip::fields() {
  static constexpr Field kFields[] = {kWidthKey<WedgeTip>, kLengthKey<WedgeTip>,
                                      kAngleKey<WedgeTip>, kEdgeRadiusKey<WedgeTip>};
  return {"probe", kFields};
}

// Cone

FieldTable ConeTip::fields() {
  static constexpr Field kFields[] = {kDiameterKey<ConeTip>, kAngleKey<ConeTip>,
                                      kEdgeRadiusKey<ConeTip>};
  return {"probe", kFields};
}

// Cylinder

FieldTable CylinderTip::fields() {
  static constexpr Field kFields[] = {kRadiusKey<CylinderTip>, kLengthKey<CylinderTip>};
  return {"probe", kFields};
}

void CylinderTip::check(const SkinParameters& /*skin*/, ParameterCheck& all) const {
  all.require(std::isfinite(radius_mm), "probe.radius_mm",
              "must be finite for a cylinder: for a flat plate, set tip = \"sphere\"");
}

// Dots

FieldTable DotsTip::fields() {
  static constexpr Field kFields[] = {
      {"dots_mm", "mm", from_to(-100.0, 100.0),
       "[[x, y], …]: centres of dots, from the probe's axis", at<&DotsTip::centres>},
      kDiameterKey<DotsTip>,
      kEdgeRadiusKey<DotsTip>};
  return {"probe", kFields};
}

void DotsTip::check(const SkinParameters& /*skin*/, ParameterCheck& all) const {
  all.require(!centres.empty() && centres.size() <= kMaxDots, "probe.dots_mm",
              "must list from 1 to 200 centres, as in [[0, 0], [2.5, 0]]");
}

Position DotsTip::half_size() const noexcept {
  Position most;
  for (const Position& dot : centres) {
    most = {std::max(most.x_mm, std::fabs(dot.x_mm)), std::max(most.y_mm, std::fabs(dot.y_mm))};
  }
  return {most.x_mm + 0.5 * diameter_mm, most.y_mm + 0.5 * diameter_mm};
}

// Shape

FieldTable ShapeTip::fields() {
  static constexpr Field kFields[] = {
      {"shape", "", any_value(),
       "file with the heights of the tip \"shape\", mm from its lowest plane towards the probe, "
       "inf where there is no tip: NPY or CSV; a row is a line along x; tools/shape_map makes one from "
       "STL or 16-bit PNG",
       at<&ShapeTip::file>},
      {"pixel_mm", "mm", not_negative(10.0), "distance between the heights of shape; must be set",
       at<&ShapeTip::pixel_mm>}};
  return {"probe", kFields};
}

void ShapeTip::check(const SkinParameters& skin, ParameterCheck& all) const {
  all.require(pixel_mm > 0.0, "probe.pixel_mm",
              "is missing: set the distance between the heights in shape, in mm")
      .require(map != nullptr, "probe.shape",
               "is missing: name the file with the heights of the tip")
      .require(pixel_mm <= 0.5 * skin.receptor_depth_mm, "probe.pixel_mm",
               "must be at most half of skin.receptor_depth_mm, or the receptors would feel the "
               "steps between heights: measure or interpolate the shape more finely");
}

Position ShapeTip::half_size() const noexcept {
  const PixelGrid& grid = map->grid;
  return {0.5 * grid.pixel_mm * static_cast<double>(grid.columns),
          0.5 * grid.pixel_mm * static_cast<double>(grid.rows)};
}

}  // namespace merkel
