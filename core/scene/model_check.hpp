#pragma once

#include <optional>

#include "core/expected.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {

/// Rejects invalid or contradictory parameters.
[[nodiscard]] Expected<void, ParameterError> check(const TactileModel::Parameters& p);

/// Rejects a step at which the method would diverge or give wrong spike counts.
[[nodiscard]] Expected<void, ParameterError> check_step(
    const TactileModel::Parameters& p, const std::optional<LatticeCoupling>& network);

}  // namespace merkel
