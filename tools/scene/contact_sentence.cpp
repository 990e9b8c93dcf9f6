#include "tools/scene/contact_sentence.hpp"

#include <array>
#include <cstdio>
#include <string>

#include "core/contact/contact_validity.hpp"
#include "core/contact/pressed_tip.hpp"

namespace merkel {

std::string contact_sentence(const ContactState& contact, const Indenter& indenter,
                             const SkinParameters& skin) {
  if (indenter.prescribed()) {
    return "the pressures of " + std::to_string(indenter.taxels.size()) +
           " taxels, as measured, on " + (skin.layers.empty() ? "a half-space" : "layered skin") +
           "; linear elasticity without friction, no contact law";
  }
  if (!indenter.closed_form(skin)) {
    const PressedTip tip = pressed_tip(indenter, skin);
    const PixelGrid grid = contact_pixels(tip, skin.receptor_depth_mm);
    std::array<char, 64> depths{"proportional to the depth"};
    if (!tip.proportional) {
      std::snprintf(depths.data(), depths.size(), "at depths to %.2g mm", tip.deepest_mm);
    }
    std::array<char, 320> text{};
    std::snprintf(text.data(), text.size(),
                  "contact of the tip \"%s\" solved on %zu x %zu pixels of %.3f mm, %s; linear "
                  "elasticity without friction, valid while the depth is small beside the tip's "
                  "smallest part%s",
                  std::string(Indenter::name_of(indenter.tip)).c_str(),
                  static_cast<std::size_t>(grid.columns), static_cast<std::size_t>(grid.rows),
                  grid.pixel_mm, depths.data(),
                  skin.stiffens() ? "; the skin stiffens with depth" : "");
    return text.data();
  }
  return validity_of(contact, skin, indenter.radius_mm).sentence();
}

std::string contact_sentence(const Press& press, const TactileModel& model, std::size_t probe) {
  return contact_sentence(press.contact, model.parameters().indenters[probe],
                          model.parameters().skin);
}

}  // namespace merkel
