#pragma once

#include <string>

#include "core/scene/tactile_model.hpp"

namespace merkel {

/// The validity of a probe's contact law at a press, as a sentence.
[[nodiscard]] std::string contact_sentence(const Press& press, const TactileModel& model,
                                           std::size_t probe);

}  // namespace merkel
