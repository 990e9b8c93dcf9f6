#pragma once

#include <string>

#include "core/scene/tactile_model.hpp"

namespace merkel {

/// The validity of a contact law at a press, as a sentence.
/// \param by_tables  the press is that of a model, which interpolates between solved depths
[[nodiscard]] std::string contact_sentence(const ContactState& contact, const Indenter& indenter,
                                           const SkinParameters& skin, bool by_tables = false);
/// The same for a probe of a model.
[[nodiscard]] std::string contact_sentence(const Press& press, const TactileModel& model,
                                           std::size_t probe);

}  // namespace merkel
