#pragma once

#include <cstddef>
#include <cstdint>

#include "core/math/normal_random.hpp"
#include "core/neurons/hodgkin_huxley/kernel/membrane_kernel.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

static_assert(kNeuronBlock == 2 * NormalStream::kDistance);

/// N neurons, padded to whole blocks.
[[nodiscard]] constexpr std::size_t whole_blocks(std::size_t neurons) noexcept {
  return (neurons + kNeuronBlock - 1) / kNeuronBlock * kNeuronBlock;
}

/// The keys of the pairs of N neurons' noise, eight for each block of neurons.
[[nodiscard]] inline AlignedArray<std::uint64_t> noise_keys(std::uint64_t seed,
                                                            std::size_t neurons) {
  AlignedArray<std::uint64_t> keys(whole_blocks(neurons) / 2);
  for (std::size_t pair = 0; pair < keys.size(); ++pair) keys[pair] = normal_key(seed, pair);
  return keys;
}

}  // namespace merkel
