#include "tools/scene/contact_sentence.hpp"

#include <cmath>
#include <string>

#include "core/contact/contact_validity.hpp"

namespace merkel {

std::string contact_sentence(const ContactState& contact, const Indenter& indenter,
                             const SkinParameters& skin) {
  const std::string stiffening =
      std::isfinite(skin.stiffening_mm) ? "; the skin stiffens with depth" : "";
  if (indenter.tip == Indenter::Tip::kBars) {
    return (std::isfinite(skin.radius_mm)
                ? "flat bars on a curved finger: the contact grows with depth; force within 5 % and "
                  "energy density within 15 % of boundary elements for bars 1 and 3 mm wide"
                : "flat bars, linear at any depth; strains are of the order of depth over bar width") +
           stiffening;
  }
  if (indenter.tip == Indenter::Tip::kPin) {
    return (std::isfinite(skin.radius_mm)
                ? "flat pin on a curved finger: a plate until its rim touches, then a punch; within "
                  "3 % of boundary elements where the finger is as curved along as across, and for "
                  "pins of 1 mm on longer fingers (a pin of 6.35 mm: force up to 17 % too low, energy "
                  "density up to 54 % too high)"
                : "flat pin, linear at any depth; strains are of the order of depth over diameter") +
           stiffening;
  }
  return validity_of(contact, skin, indenter.radius_mm).sentence();
}

std::string contact_sentence(const Press& press, const TactileModel& model, std::size_t probe) {
  return contact_sentence(press.contact, model.parameters().indenters[probe],
                          model.parameters().skin);
}

}  // namespace merkel
