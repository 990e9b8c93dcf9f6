#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// The instruction set that the kernels use: the best that the processor has, unless forced.
/// "avx512", "avx2", "sse4", "neon" or "scalar". All give the same bits.
[[nodiscard]] std::string simd_target();

/// Those that this processor can run, best first.
[[nodiscard]] std::vector<std::string> simd_targets();

/// Makes the kernels use an instruction set; "" lets them choose again. For tests and comparisons;
/// before any kernel runs. Real-time: no.
[[nodiscard]] Expected<void, SetupError> force_simd_target(std::string_view name);

}  // namespace merkel
