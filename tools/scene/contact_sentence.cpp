#include "tools/scene/contact_sentence.hpp"

#include <string>

#include <fmt/core.h>

#include "core/contact/contact_validity.hpp"
#include "core/contact/pressed_tip.hpp"

namespace merkel {

std::string contact_sentence(const ContactState& contact, const Indenter& indenter,
                             const SkinParameters& skin) {
  if (!indenter.closed_form(skin)) {
    const PressedTip tip = pressed_tip(indenter, skin);
    const PixelGrid grid = contact_pixels(tip, skin.receptor_depth_mm);
    return fmt::format(
        "contact of the tip \"{}\" solved on {} x {} pixels of {:.3f} mm, {}; linear elasticity "
        "without friction, valid while the depth is small beside the tip's smallest part{}",
        Indenter::name_of(indenter.tip), grid.columns, grid.rows, grid.pixel_mm,
        tip.proportional ? "proportional to the depth"
                         : fmt::format("at depths to {:.2g} mm", tip.deepest_mm),
        skin.stiffens() ? "; the skin stiffens with depth" : "");
  }
  return validity_of(contact, skin, indenter.radius_mm).sentence();
}

std::string contact_sentence(const Press& press, const TactileModel& model, std::size_t probe) {
  return contact_sentence(press.contact, model.parameters().indenters[probe],
                          model.parameters().skin);
}

}  // namespace merkel
