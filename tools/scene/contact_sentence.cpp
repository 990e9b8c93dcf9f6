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
    const bool longer = skin.radius_along_mm > skin.radius_mm;
    return (std::isfinite(skin.radius_mm)
                ? std::string(
                      "flat pin on a curved finger: a plate until its rim touches, then a punch; ") +
                      (longer
                           ? "the contact neglects that the finger is less curved along than "
                             "across: no error for a pin of 1 mm, but for one of 6.35 mm and 14 mm "
                             "along, force 17 % too low, energy density 54 % too high in the "
                             "middle and 80 % too low at the rim"
                           : "within 3 % of boundary elements for 1 and 6.35 mm")
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
