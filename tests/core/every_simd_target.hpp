#pragma once

#include <string>

#include <gtest/gtest.h>

#include "core/simd/simd_target.hpp"

namespace merkel {

/// Calls `compute()` with each instruction set that this processor supports, and expects the same
/// result from all. Returns the result.
template <class Compute>
auto on_every_simd_target(Compute compute) {
  const auto expected = compute();
  for (const std::string& target : simd_targets()) {
    EXPECT_TRUE(force_simd_target(target));
    EXPECT_TRUE(compute() == expected) << target;
  }
  EXPECT_TRUE(force_simd_target(""));
  return expected;
}

}  // namespace merkel
