#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// The instruction set that the kernels use: the best one that the processor supports, unless
/// forced. "avx512", "avx2", "neon" or "scalar". All give the same bits.
[[nodiscard]] std::string simd_target();

/// The instruction sets that this processor supports, best first.
[[nodiscard]] std::vector<std::string> simd_targets();

/// Forces an instruction set; "" restores the automatic choice. For tests and comparisons; call
/// before any kernel runs. Real-time: no.
[[nodiscard]] Expected<void, SetupError> force_simd_target(std::string_view name);

}  // namespace merkel
