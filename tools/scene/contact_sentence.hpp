#pragma once

#include <string>

#include "core/scene/tactile_model.hpp"

namespace merkel {

/// How far the contact law of a probe can be trusted at a press, for people.
[[nodiscard]] std::string contact_sentence(const Press& press, const TactileModel& model,
                                           std::size_t probe);

}  // namespace merkel
