#include "core/contact/indenter.hpp"

#include <algorithm>
#include <cmath>

#include "core/contact/pressed_tip.hpp"

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
  all.fields(*this).fields(pin).fields(shape);
  if (tip == Tip::kSphere) {
    all.require(std::isfinite(radius_mm) || std::isfinite(skin.radius_mm), "probe.radius_mm",
                "may be inf (a flat plate) only on a curved finger: set skin.radius_mm");
  }
  if (closed_form(skin)) return all.result();
  if (tip == Tip::kTaxels) {
    return all.also(taxels.check())
        .require(!skin.stiffens(), "skin.stiffening_mm",
                 "must be inf for the tip \"taxels\": an array measures no depth, with which the "
                 "skin could stiffen")
        .require(skin.receptor_depth_mm >= 0.05, "skin.receptor_depth_mm",
                 "must be at least 0.05 under this tip: the stress jumps at the edges of a taxel")
        .result();
  }
  if (tip == Tip::kBars) all.also(bars.check());
  if (tip == Tip::kShape) check_shape(*this, skin, all);
  const double smallest = tip == Tip::kEdge || tip == Tip::kWedge
                              ? std::min(shape.width_mm, shape.length_mm)
                              : (tip == Tip::kPin || tip == Tip::kDots ? pin.diameter_mm : 1e3);
  all.require(tip != Tip::kCylinder || std::isfinite(radius_mm), "probe.radius_mm",
              "must be finite for a cylinder: for a flat plate, set tip = \"sphere\"")
      .require(tip != Tip::kDots || (!shape.dots.empty() && shape.dots.size() <= shape.kMostDots),
               "probe.dots_mm", "must list from 1 to 200 centres, as in [[0, 0], [2.5, 0]]")
      .require(tip == Tip::kWedge || tip == Tip::kCone || 2.0 * shape.edge_radius_mm <= smallest,
               "probe.edge_radius_mm", "must be at most half of the tip's smallest width")
      .require(skin.contact_law == ContactLaw::kHertz || tip == Tip::kSphere, "skin.contact_law",
               "applies to spheres only: remove it for this tip")
      .require(skin.receptor_depth_mm >= 0.05, "skin.receptor_depth_mm",
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
