#include "tools/scene/contact_sentence.hpp"

#include "core/contact/contact_validity.hpp"

namespace merkel {

std::string contact_sentence(const Press& press, const TactileModel& model, std::size_t probe) {
  const Indenter& indenter = model.parameters().indenters[probe];
  if (indenter.tip == Indenter::Tip::kBars) {
    return "flat bars, linear at any depth; strains are of the order of depth over bar width";
  }
  if (indenter.tip == Indenter::Tip::kPin) {
    return "flat pin, linear at any depth; strains are of the order of depth over diameter";
  }
  return validity_of(press.contact, model.parameters().skin, indenter.radius_mm).sentence();
}

}  // namespace merkel
