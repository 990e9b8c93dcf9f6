#pragma once

#include <cstdint>

namespace merkel {

/// In which precision the kernels keep their state.
enum class Precision : std::uint8_t { kDouble, kFloat };

}  // namespace merkel
