#include "core/contact/tip_contact.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/contact/hertz_contact.hpp"
#include "core/math/portable_math.hpp"

namespace merkel {
namespace {

/// Deeper presses use the shape of the field at this depth.
constexpr double kDeepest_mm = 10.0;

/// Ratio of the contact's offset from the apex to the tip's.
double kept_of(double tip_radius_mm, double skin_radius_mm) {
  return std::isinf(skin_radius_mm) ? 1.0 : skin_radius_mm / (skin_radius_mm + tip_radius_mm);
}

}  // namespace

std::shared_ptr<const LayerField> TipContact::layer_field(std::span<const Indenter> indenters,
                                                          const SkinParameters& skin) {
  if (!skin.exactly_layered()) return nullptr;
  double largest_mm = 0.0;
  for (const Indenter& indenter : indenters) {
    if (indenter.tip != Indenter::Tip::kSphere) continue;
    const SphereLaw law(skin, indenter.radius_mm);
    largest_mm = std::max(largest_mm, law.at_depth(kDeepest_mm).contact_radius_mm);
  }
  return largest_mm > 0.0 ? std::make_shared<LayerField>(skin, largest_mm) : nullptr;
}

TipContact::TipContact(const Indenter& indenter, const SkinParameters& skin,
                       std::shared_ptr<const LayerField> layer)
    : by_force_(indenter.control == Indenter::Control::kForce), stiffening_mm_(skin.stiffening_mm) {
  switch (indenter.tip) {
    case Indenter::Tip::kSphere:
      sphere_.emplace(skin, indenter.radius_mm);
      layer_ = layer ? std::move(layer) : layer_field({&indenter, 1}, skin);
      if (skin.apex) {
        apex_ = *skin.apex;
        kept_across_ = kept_of(indenter.radius_mm, skin.radius_mm);
        kept_along_ = kept_of(indenter.radius_mm,
                              skin.radius_along_mm > 0.0 ? skin.radius_along_mm : skin.radius_mm);
      }
      break;
    case Indenter::Tip::kBars:
      flat_tip_ = std::make_shared<FlatTipField>(indenter.bars, skin);
      if (skin.apex) {
        // Across the finger, straight bars always touch the apex.
        apex_ = *skin.apex;
        kept_across_ = 0.0;
      }
      break;
    case Indenter::Tip::kPin:
      flat_tip_ = std::make_shared<FlatTipField>(indenter.pin, skin);
      break;
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
  if (!by_force_) return press_at_depth(input, input.depth_mm);
  if (sphere_) return placed(input, sphere_->at_force(input.force_mN));
  return press_at_depth(input, flat_depth_mm(input.force_mN));
}

Press TipContact::press_at_depth(const ContactInput& input, double depth_mm) const noexcept {
  if (sphere_) return placed(input, sphere_->at_depth(depth_mm));
  const double depth = std::max(0.0, depth_mm);
  const double stiffening = stiffening_of(depth);
  return placed(input, {.depth_mm = depth,
                        .force_mN = stiffening * flat_tip_->force_mN(depth),
                        .contact_radius_mm = 0.0,
                        .peak_pressure_kPa = 0.0,
                        .stiffening = stiffening});
}

double TipContact::stiffening_of(double depth_mm) const noexcept {
  return std::isinf(stiffening_mm_) ? 1.0 : portable_exp(depth_mm / stiffening_mm_);
}

double TipContact::flat_depth_mm(double force_mN) const noexcept {
  const double elastic_mm = flat_tip_->depth_mm(force_mN);
  if (std::isinf(stiffening_mm_)) return elastic_mm;
  double low = 0.0;
  double high = elastic_mm;  // the skin can only be stiffer
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    (stiffening_of(middle) * flat_tip_->force_mN(middle) < force_mN ? low : high) = middle;
  }
  return high;
}

double TipContact::displacement_mm(const Press& press, double x_mm, double y_mm) const noexcept {
  const double dx = x_mm - press.x_mm;
  const double dy = y_mm - press.y_mm;
  if (flat_tip_) return flat_tip_->at(dx, dy, press.contact.depth_mm).displacement;
  const double r = std::hypot(dx, dy);
  return layer_ ? layer_->displacement_mm(press.contact, r)
                : HertzContact::surface_displacement_mm(press.contact, r);
}

}  // namespace merkel
