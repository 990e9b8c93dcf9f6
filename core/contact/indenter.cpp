#include "core/contact/indenter.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/contact/pressed_tip.hpp"
#include "core/contact/surface_map.hpp"

namespace merkel {
namespace {

Expected<void, ParameterError> check_surface(const Indenter& t, const SkinParameters& skin) {
  const SlidingSurface& surface = t.surface;
  const auto checked =
      ParameterCheck()
          .require(t.taxels() == nullptr, "probe.surface", "must be false for the tip \"taxels\"")
          .require(t.sphere() == nullptr || std::isinf(t.sphere()->radius_mm), "probe.radius_mm",
                   "must be inf for a surface, a plate: for a sphere, set surface = false")
          .require(std::isfinite(skin.radius_mm), "skin.radius_mm",
                   "must be finite under a surface: set the finger's radius, as in 7")
          .require(skin.apex.has_value(), "skin.apex_mm",
                   "is missing: set the place of the finger that the surface touches, as in [15, "
                   "10]")
          .require(skin.receptor_depth_mm >= Indenter::kMinDepth_mm, "skin.receptor_depth_mm",
                   "must be at least 0.05 under a surface")
          .result();
  if (!checked) return checked;
  const Position half = half_extent(t);
  const auto overlaps = [](double period_mm, double half_mm) {
    return period_mm > 0.0 && half_mm > 1.5 * period_mm;
  };
  const auto apart =
      ParameterCheck()
          .require(
              !overlaps(surface.period_x_mm, half.x_mm) &&
                  !overlaps(surface.period_y_mm, half.y_mm),
              overlaps(surface.period_x_mm, half.x_mm) ? "probe.period_x_mm" : "probe.period_y_mm",
              "is less than a third of the part that repeats: make the part smaller")
          .result();
  if (!apart) return apart;
  return ParameterCheck()
      .require(SlidingPlan::of(t, skin, std::chrono::milliseconds(1)).has_value(),
               "probe.deepest_mm",
               "gives a contact with too many pixels of the size that the surface's smallest part "
               "and periods need: make it smaller, or enlarge that part")
      .result();
}

/// The parameters of the tip itself.
Expected<void, ParameterError> check_tip(const Indenter& indenter, const SkinParameters& skin) {
  ParameterCheck all;
  all.fields(indenter).fields(indenter.surface);
  std::visit(
      [&](const auto& tip) {
        if constexpr (requires { tip.check(skin, all); }) tip.check(skin, all);
        all.fields(tip);
        if constexpr (requires { tip.edge_radius_mm + tip.feature_mm(); }) {
          all.require(2.0 * tip.edge_radius_mm <= tip.feature_mm(), "probe.edge_radius_mm",
                      "must be at most half of the tip's smallest width");
        }
      },
      indenter.tip);
  return all
      .require(skin.contact_law == ContactLaw::kHertz || indenter.sphere() != nullptr,
               "skin.contact_law", "applies to spheres only: remove it for this tip")
      .result();
}

}  // namespace

FieldTable Indenter::tip_field() {
  static constexpr Field kFields[] = {
      {"tip", "", one_of(kTipNames), "shape of the tip; the other keys depend on it",
       [](void* indenter) -> FieldPointer {
         return Choice{indenter,
                       [](const void* p) -> std::optional<std::size_t> {
                         return static_cast<const Indenter*>(p)->tip.index();
                       },
                       [](void* p, std::size_t index) {
                         Tip& chosen = static_cast<Indenter*>(p)->tip;
                         if (index != chosen.index()) chosen = default_tip(index);
                       }};
       }}};
  return {"probe", kFields};
}

FieldTable Indenter::fields() {
  static constexpr Field kFields[] = {
      {"orientation_deg", "°", from_to(-360.0, 360.0),
       "turns any tip but a sphere counterclockwise around the probe's axis",
       at<&Indenter::orientation_deg>},
      {"tilt_deg", "°", from_to(-60.0, 60.0), "tilts any tip but a sphere: it rises along x",
       at<&Indenter::tilt_deg>}};
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

Expected<void, ParameterError> Indenter::check(const SkinParameters& skin) const {
  if (const auto checked = check_tip(*this, skin); !checked) return checked;
  if (surface.slides) return check_surface(*this, skin);
  if (circular(skin)) return {};
  if (taxels() != nullptr) {
    return ParameterCheck()
        .require(!skin.stiffens(),
                 std::isfinite(skin.stiffening_kPa) ? "skin.stiffening_kPa" : "skin.stiffening_mm",
                 "must be inf for the tip \"taxels\": an array measures neither depth nor "
                 "contact, with which the skin could stiffen")
        .require(skin.receptor_depth_mm >= kMinDepth_mm, "skin.receptor_depth_mm",
                 "must be at least 0.05 under this tip: the stress jumps at the edges of a taxel")
        .result();
  }
  const auto checked =
      ParameterCheck()
          .require(skin.receptor_depth_mm >= kMinDepth_mm, "skin.receptor_depth_mm",
                   "must be at least 0.05 under this tip: the pressure at its rims is infinite")
          .result();
  if (!checked) return checked;
  return ParameterCheck()
      .require(
          fits(pressed_tip(*this, skin), skin.receptor_depth_mm),
          std::holds_alternative<BarTip>(tip) ? "probe.bar_widths_mm" : "probe.tip",
          "makes a tip so large that 65536 pixels cannot resolve its smallest part and what the "
          "receptors feel: make the tip smaller or its smallest part larger")
      .result();
}

}  // namespace merkel
