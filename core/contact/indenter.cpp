#include "core/contact/indenter.hpp"

#include <cmath>

#include "core/contact/flat_tip_field.hpp"

namespace merkel {

FieldTable Indenter::fields() {
  static constexpr std::string_view kTips[] = {"sphere", "bars", "pin"};
  static constexpr Field kFields[] = {
      {"tip", "", one_of(kTips), "shape of the tip", at<&Indenter::tip>},
      {"radius_mm", "mm", positive_or_infinite(1e6),
       "radius of a sphere; inf is a flat plate, on a curved finger only",
       at<&Indenter::radius_mm>}};
  return {"probe", kFields};
}

Expected<void, ParameterError> Indenter::check(const SkinParameters& skin) const {
  if (tip == Tip::kBars) {
    return ParameterCheck()
        .also(bars.check())
        .require(!skin.layered() && skin.contact_law == ContactLaw::kHertz, "probe.tip",
                 "\"bars\" needs skin without a layer: remove skin.thickness_mm and "
                 "skin.contact_law")
        .require(skin.receptor_depth_mm >= 0.05, "skin.receptor_depth_mm",
                 "must be at least 0.05 under bars: the pressure at their edges is infinite")
        .require(
            FlatTipField::fits(bars, skin), "probe.bar_widths_mm",
            "and bar_length_mm make a tip so large that its stress field needs more than 260 MB "
            "or about ten seconds: make the tip smaller")
        .result();
  }
  if (tip == Tip::kPin) {
    return ParameterCheck()
        .also(pin.check())
        .require(!skin.layered() && skin.contact_law == ContactLaw::kHertz, "probe.tip",
                 "\"pin\" needs skin without a layer: remove skin.thickness_mm and "
                 "skin.contact_law")
        .require(skin.receptor_depth_mm >= 0.05, "skin.receptor_depth_mm",
                 "must be at least 0.05 under a pin: the pressure at its rim is infinite")
        .require(FlatTipField::fits(pin, skin), "probe.diameter_mm",
                 "makes a tip so large that its stress field needs more than 260 MB: make it "
                 "smaller")
        .result();
  }
  return ParameterCheck()
      .fields(*this)
      .require(std::isfinite(radius_mm) || std::isfinite(skin.radius_mm), "probe.radius_mm",
               "may be inf (a flat plate) only on a curved finger: set skin.radius_mm")
      .result();
}

}  // namespace merkel
