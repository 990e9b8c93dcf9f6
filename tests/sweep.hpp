#pragma once

#include <cstddef>
#include <cstdlib>

namespace merkel {

/// Whether a long sweep tries its item `number`: every `thin`-th one, or, with MERKEL_FULL_SWEEPS
/// in the environment, each.
inline bool in_sweep(std::size_t number, std::size_t thin) {
  return number % thin == 0 || std::getenv("MERKEL_FULL_SWEEPS") != nullptr;
}

}  // namespace merkel
