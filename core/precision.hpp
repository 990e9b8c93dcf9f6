#pragma once

#include <cstdint>

namespace merkel {

/// The precision in which the kernels keep their state.
enum class Precision : std::uint8_t { kDouble, kFloat };

}  // namespace merkel
