#pragma once

#include "core/precision.hpp"

namespace merkel {

/// The rate of fused multiply-adds on registers of one core, GFLOP/s (a multiply-add counts as
/// two), with the present instruction set: an upper bound for the kernels.
[[nodiscard]] double fma_peak_gflops(Precision precision);

}  // namespace merkel
