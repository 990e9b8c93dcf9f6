#pragma once

#include "core/precision.hpp"

namespace merkel {

/// What one core of this machine reaches in fused multiply-adds on registers, GFLOP/s (a
/// multiply-add counts as two), with the instruction set in use: the roof that the kernels stand
/// under.
[[nodiscard]] double fma_peak_gflops(Precision precision);

}  // namespace merkel
