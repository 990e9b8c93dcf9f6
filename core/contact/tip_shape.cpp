#include "core/contact/tip_shape.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace merkel {

FieldTable PinTip::fields() {
  static constexpr Field kFields[] = {
      {"diameter_mm", "mm", positive(100.0),
       "diameter of a flat round pin, of each dot, or of the base of a cone",
       at<&PinTip::diameter_mm>}};
  return {"probe", kFields};
}

FieldTable BarTip::fields() {
  static constexpr Field kFields[] = {
      {"bar_widths_mm", "mm", positive(100.0), "width of each bar, along x",
       at<&BarTip::widths_mm>},
      {"bar_gaps_mm", "mm", positive(100.0), "gap between neighbouring bars, one fewer than bars",
       at<&BarTip::gaps_mm>},
      {"bar_length_mm", "mm", positive(1e3), "length of the bars, along y",
       at<&BarTip::length_mm>}};
  return {"probe", kFields};
}

FieldTable TipShape::fields() {
  using T = TipShape;
  static constexpr Field kFields[] = {
      {"width_mm", "mm", positive(100.0), "width of an edge or of the base of a wedge, along x",
       at<&T::width_mm>},
      {"length_mm", "mm", positive(100.0), "length of an edge, wedge or cylinder, along y",
       at<&T::length_mm>},
      {"angle_deg", "°", from_to(10.0, 178.0), "angle between the faces of a wedge or cone",
       at<&T::angle_deg>},
      {"dots_mm", "mm", from_to(-100.0, 100.0),
       "[[x, y], …]: centres of dots, from the probe's axis", at<&T::dots>},
      {"edge_radius_mm", "mm", not_negative(100.0),
       "rounds the rims of flat ends, the ridge of a wedge and the apex of a cone; 0: sharp",
       at<&T::edge_radius_mm>},
      {"orientation_deg", "°", from_to(-360.0, 360.0),
       "turns any tip but a sphere counterclockwise around the probe's axis",
       at<&T::orientation_deg>},
      {"tilt_deg", "°", from_to(-60.0, 60.0), "tilts any tip but a sphere: it rises along x",
       at<&T::tilt_deg>},
      {"shape", "", any_value(),
       "file with the heights of the tip \"shape\", mm from its lowest plane towards the probe, "
       "inf where there is no tip: NPY or CSV; a row is a line along x; tools/shape_map makes one from "
       "STL or 16-bit PNG",
       at<&T::file>},
      {"pixel_mm", "mm", not_negative(10.0), "distance between the heights of shape; must be set",
       at<&T::pixel_mm>}};
  return {"probe", kFields};
}

FieldTable SlidingSurface::fields() {
  using S = SlidingSurface;
  static constexpr Field kFields[] = {
      {"surface", "", any_value(),
       "true: the tip is a surface that slides under a finger with skin.apex_mm, x_mm and y_mm its "
       "middle; depth is that of its highest parts below the apex",
       at<&S::slides>},
      {"relief_mm", "mm", positive_or_infinite(100.0),
       "height of the parts of a surface above its base plate; inf: no base", at<&S::relief_mm>},
      {"period_x_mm", "mm", not_negative(100.0),
       "distance after which a surface repeats along x; 0: it does not", at<&S::period_x_mm>},
      {"period_y_mm", "mm", not_negative(100.0), "the same along y", at<&S::period_y_mm>},
      {"deepest_mm", "mm", positive(5.0),
       "depth of a surface for which its contact has room; more makes the pixels coarser",
       at<&S::deepest_mm>}};
  return {"probe", kFields};
}

Expected<void, ParameterError> BarTip::check() const {
  ParameterCheck all;
  all.require(!widths_mm.empty() && widths_mm.size() <= kMostBars, "probe.bar_widths_mm",
              "must list from 1 to 40 widths")
      .require(gaps_mm.size() + 1 == std::max<std::size_t>(widths_mm.size(), 1),
               "probe.bar_gaps_mm", "must list one gap fewer than there are bars");
  for (const double gap : gaps_mm) {
    all.require(gap > 0.0 && std::isfinite(gap), "probe.bar_gaps_mm",
                "must be positive: merge bars that touch or overlap, or widen the gap");
  }
  return all.fields(*this).result();
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

}  // namespace merkel
