#include "core/contact/tip_contact.hpp"

#include <algorithm>

namespace merkel {

TipContact::TipContact(const Indenter& indenter, const SkinParameters& skin)
    : by_force_(indenter.control == Indenter::Control::kForce) {
  switch (indenter.tip) {
    case Indenter::Tip::kSphere:
      sphere_.emplace(skin, indenter.radius_mm);
      if (skin.apex) {
        apex_ = *skin.apex;
        offset_kept_ = sphere_->effective_radius_mm() / indenter.radius_mm;
      }
      break;
    case Indenter::Tip::kBars:
      flat_tip_ = std::make_shared<FlatTipField>(indenter.bars, skin);
      break;
    case Indenter::Tip::kPin:
      flat_tip_ = std::make_shared<FlatTipField>(indenter.pin, skin);
      break;
  }
}

Press TipContact::press(const ContactInput& input) const noexcept {
  Press press{.contact = {}, .x_mm = input.x_mm, .y_mm = input.y_mm};
  if (sphere_) {
    press.contact =
        by_force_ ? sphere_->at_force(input.force_mN) : sphere_->at_depth(input.depth_mm);
    if (apex_) {
      press.x_mm = apex_->x_mm + offset_kept_ * (input.x_mm - apex_->x_mm);
      press.y_mm = apex_->y_mm + offset_kept_ * (input.y_mm - apex_->y_mm);
    }
    return press;
  }
  const double stiffness = flat_tip_->force_mN_per_mm();
  press.contact.depth_mm = std::max(0.0, by_force_ ? input.force_mN / stiffness : input.depth_mm);
  press.contact.force_mN = press.contact.depth_mm * stiffness;
  return press;
}

}  // namespace merkel
