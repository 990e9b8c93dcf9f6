#include "core/contact/tip_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/contact/hertz_contact.hpp"
#include "core/math/bisection.hpp"

namespace merkel {
namespace {

/// Ratio of the contact's offset from the apex to the tip's.
double kept_of(double tip_radius_mm, double skin_radius_mm) {
  return std::isinf(skin_radius_mm) ? 1.0 : skin_radius_mm / (skin_radius_mm + tip_radius_mm);
}

}  // namespace

TipContact::TipContact(const Indenter& indenter, const SkinParameters& skin)
    : by_force_(indenter.control == Indenter::Control::kForce), skin_(skin) {
  if (indenter.taxels() != nullptr) return;  // its pressures are prescribed
  if (skin.apex) apex_ = *skin.apex;
  if (indenter.surface.slides) {
    // Until it slides, as a plate: it touches the apex.
    sphere_.emplace(skin, std::numeric_limits<double>::infinity());
    kept_along_ = kept_across_ = 0.0;
    return;
  }
  if (indenter.closed_form(skin)) sphere_.emplace(skin, indenter.sphere()->radius_mm);
  if (!indenter.circular(skin)) field_ = TipField::shared(indenter, skin);
  if (std::holds_alternative<BarTip>(indenter.tip)) {
    kept_across_ = 0.0;  // straight bars always touch the apex
    return;
  }
  if (const SphereTip* const sphere = indenter.sphere(); sphere != nullptr && apex_) {
    kept_across_ = kept_of(sphere->radius_mm, skin.radius_mm);
    kept_along_ = kept_of(sphere->radius_mm, skin.finger_along_mm());
  } else {
    apex_.reset();
  }
}

Press TipContact::placed(const ContactInput& input, const ContactState& contact) const noexcept {
  Press press{.contact = contact, .x_mm = input.x_mm, .y_mm = input.y_mm};
  if (apex_) {
    press.x_mm = apex_->x_mm + kept_along_ * (input.x_mm - apex_->x_mm);
    press.y_mm = apex_->y_mm + kept_across_ * (input.y_mm - apex_->y_mm);
  }
  return press;
}

Press TipContact::press(const ContactInput& input) const noexcept {
  if (!sphere_ && !field_) return placed(input, {.force_mN = input.force_mN});
  if (!by_force_) return press_at_depth(input, input.depth_mm);
  if (sphere_) return placed(input, sphere_->at_force(input.force_mN));
  return press_at_depth(input, solved_depth_mm(input.force_mN));
}

Press TipContact::press_at_depth(const ContactInput& input, double depth_mm) const noexcept {
  if (sphere_) return placed(input, sphere_->at_depth(depth_mm));
  const double depth = std::max(0.0, depth_mm);
  const double stiffening = skin_.stiffening_at(depth, field_->mean_pressure_kPa(depth));
  return placed(input, {.depth_mm = depth,
                        .force_mN = stiffening * field_->force_mN(depth),
                        .contact_radius_mm = 0.0,
                        .peak_pressure_kPa = 0.0,
                        .stiffening = stiffening});
}

double TipContact::solved_depth_mm(double force_mN) const noexcept {
  const double elastic_mm = field_->depth_mm(force_mN);
  if (!skin_.stiffens()) return elastic_mm;
  // The skin can only be stiffer than at rest.
  return bisected(0.0, elastic_mm, [&](double depth) {
    return press_at_depth({}, depth).contact.force_mN < force_mN;
  });
}

double TipContact::displacement_mm(const Press& press, double x_mm, double y_mm) const noexcept {
  const double dx = x_mm - press.x_mm;
  const double dy = y_mm - press.y_mm;
  if (field_) return field_->at(dx, dy, press.contact.depth_mm).displacement;
  return HertzContact::surface_displacement_mm(press.contact, std::hypot(dx, dy));
}

}  // namespace merkel
