#include "core/contact/indenter.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/contact/pressed_tip.hpp"
#include "core/contact/surface_map.hpp"

namespace merkel {
namespace {

using Tip = Indenter::Tip;

constexpr std::string_view kTips[] = {"sphere", "bars",     "pin",  "edge",  "wedge",
                                      "cone",   "cylinder", "dots", "shape", "taxels"};

void check_shape(const Indenter& tip, const SkinParameters& skin, ParameterCheck& all) {
  const TipShape& shape = tip.shape;
  all.require(shape.pixel_mm > 0.0, "probe.pixel_mm",
              "is missing: set the distance between the heights in shape, in mm")
      .require(shape.map != nullptr, "probe.shape",
               "is missing: name the file with the heights of the tip");
  if (shape.map == nullptr) return;
  all.require(shape.pixel_mm <= 0.5 * skin.receptor_depth_mm, "probe.pixel_mm",
              "must be at most half of skin.receptor_depth_mm, or the receptors would feel the "
              "steps between heights: measure or interpolate the shape more finely");
}

/// The keys of a tip's own shape.
void check_tip(const Indenter& t, const SkinParameters& skin, ParameterCheck& all) {
  if (t.tip == Tip::kBars) all.also(t.bars.check());
  if (t.tip == Tip::kShape) check_shape(t, skin, all);
  const double smallest =
      t.tip == Tip::kEdge || t.tip == Tip::kWedge
          ? std::min(t.shape.width_mm, t.shape.length_mm)
          : (t.tip == Tip::kPin || t.tip == Tip::kDots ? t.pin.diameter_mm : 1e3);
  all.require(t.tip != Tip::kCylinder || std::isfinite(t.radius_mm), "probe.radius_mm",
              "must be finite for a cylinder: for a flat plate, set tip = \"sphere\"")
      .require(t.tip != Tip::kDots ||
                   (!t.shape.dots.empty() && t.shape.dots.size() <= t.shape.kMostDots),
               "probe.dots_mm", "must list from 1 to 200 centres, as in [[0, 0], [2.5, 0]]")
      .require(
          t.tip == Tip::kWedge || t.tip == Tip::kCone || 2.0 * t.shape.edge_radius_mm <= smallest,
          "probe.edge_radius_mm", "must be at most half of the tip's smallest width")
      .require(skin.contact_law == ContactLaw::kHertz || t.tip == Tip::kSphere, "skin.contact_law",
               "applies to spheres only: remove it for this tip");
}

Expected<void, ParameterError> check_surface(const Indenter& t, const SkinParameters& skin) {
  const SlidingSurface& surface = t.surface;
  ParameterCheck all;
  all.require(t.tip != Tip::kTaxels, "probe.surface", "must be false for the tip \"taxels\"")
      .require(t.tip != Tip::kSphere || std::isinf(t.radius_mm), "probe.radius_mm",
               "must be inf for a surface, a plate: for a sphere, set surface = false")
      .require(std::isfinite(skin.radius_mm), "skin.radius_mm",
               "must be finite under a surface: set the finger's radius, as in 7")
      .require(skin.apex.has_value(), "skin.apex_mm",
               "is missing: set the place of the finger that the surface touches, as in [15, 10]")
      .require(skin.receptor_depth_mm >= t.kLeastDepth_mm, "skin.receptor_depth_mm",
               "must be at least 0.05 under a surface");
  if (t.tip != Tip::kSphere) check_tip(t, skin, all);
  if (const auto checked = all.result(); !checked) return checked;
  const Position half = half_extent(t);
  const auto overlaps = [](double period_mm, double half_mm) {
    return period_mm > 0.0 && half_mm > 1.5 * period_mm;
  };
  return ParameterCheck()
      .require(
          !overlaps(surface.period_x_mm, half.x_mm) && !overlaps(surface.period_y_mm, half.y_mm),
          overlaps(surface.period_x_mm, half.x_mm) ? "probe.period_x_mm" : "probe.period_y_mm",
          "is less than a third of the part that repeats: make the part smaller")
      .require(SlidingPlan::of(t, skin, std::chrono::milliseconds(1)).has_value(),
               "probe.deepest_mm",
               "gives a contact with too many pixels of the size that the surface's smallest part "
               "and periods need: make it smaller, or enlarge that part")
      .result();
}

}  // namespace

std::string_view Indenter::name_of(Tip tip) noexcept { return kTips[static_cast<int>(tip)]; }

FieldTable Indenter::fields() {
  static constexpr Field kFields[] = {
      {"tip", "", one_of(kTips), "shape of the tip", at<&Indenter::tip>},
      {"radius_mm", "mm", positive_or_infinite(1e6),
       "radius of a sphere or cylinder; inf is a flat plate, on a curved finger only",
       at<&Indenter::radius_mm>}};
  return {"probe", kFields};
}

Expected<void, ParameterError> Indenter::check(const SkinParameters& skin) const {
  ParameterCheck all;
  all.fields(*this).fields(pin).fields(shape).fields(surface);
  if (surface.slides) return all.also(check_surface(*this, skin)).result();
  if (tip == Tip::kSphere) {
    all.require(std::isfinite(radius_mm) || std::isfinite(skin.radius_mm), "probe.radius_mm",
                "may be inf (a flat plate) only on a curved finger: set skin.radius_mm");
  }
  if (circular(skin)) return all.result();
  if (tip == Tip::kTaxels) {
    return all.also(taxels.check())
        .require(!skin.stiffens(),
                 std::isfinite(skin.stiffening_kPa) ? "skin.stiffening_kPa" : "skin.stiffening_mm",
                 "must be inf for the tip \"taxels\": an array measures neither depth nor "
                 "contact, with which the skin could stiffen")
        .require(skin.receptor_depth_mm >= kLeastDepth_mm, "skin.receptor_depth_mm",
                 "must be at least 0.05 under this tip: the stress jumps at the edges of a taxel")
        .result();
  }
  check_tip(*this, skin, all);
  all.require(skin.receptor_depth_mm >= kLeastDepth_mm, "skin.receptor_depth_mm",
              "must be at least 0.05 under this tip: the pressure at its rims is infinite");
  if (const auto checked = all.result(); !checked) return checked;
  return ParameterCheck()
      .require(
          fits(pressed_tip(*this, skin), skin.receptor_depth_mm),
          tip == Tip::kBars ? "probe.bar_widths_mm" : "probe.tip",
          "makes a tip so large that 65536 pixels cannot resolve its smallest part and what the "
          "receptors feel: make the tip smaller or its smallest part larger")
      .result();
}

}  // namespace merkel
