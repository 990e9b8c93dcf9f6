#pragma once

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {

/// Rejects invalid or contradictory parameters.
[[nodiscard]] Expected<void, ParameterError> check(const TactileModel::Parameters& p);

}  // namespace merkel
