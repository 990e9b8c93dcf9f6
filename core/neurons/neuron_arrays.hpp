#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/math/normal_random.hpp"
#include "core/realtime_tag.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// Neurons per block. Arrays are padded to whole blocks, and resting neurons are skipped in
/// blocks, so the vector width does not change any result.
inline constexpr std::size_t kNeuronBlock = 16;
static_assert(kNeuronBlock == 2 * NormalStream::kDistance);

[[nodiscard]] constexpr std::size_t blocks_of(std::size_t neurons) noexcept {
  return (neurons + kNeuronBlock - 1) / kNeuronBlock;
}
/// The number of neurons after padding to whole blocks.
[[nodiscard]] constexpr std::size_t whole_blocks(std::size_t neurons) noexcept {
  return blocks_of(neurons) * kNeuronBlock;
}

/// The input of N neurons, linear over the steps of a call.
template <class Real>
struct LinearInput {
  explicit LinearInput(std::size_t neurons)
      : begin(whole_blocks(neurons)), change(whole_blocks(neurons)) {}

  /// \param at_begin, at_end  N values each
  /// Real-time: yes.
  void set(std::span<const double> at_begin,
           std::span<const double> at_end) noexcept MERKEL_REALTIME {
    for (std::size_t i = 0; i < at_begin.size(); ++i) {
      begin[i] = static_cast<Real>(at_begin[i]);
      change[i] = static_cast<Real>(at_end[i] - at_begin[i]);
    }
  }

  AlignedArray<Real> begin;   ///< at the beginning of the first step
  AlignedArray<Real> change;  ///< until the end of the last step
};

/// The noise keys of N neurons: one per pair, eight per block.
[[nodiscard]] inline AlignedArray<std::uint64_t> noise_keys(std::uint64_t seed,
                                                            std::size_t neurons) {
  AlignedArray<std::uint64_t> keys(whole_blocks(neurons) / 2);
  for (std::size_t pair = 0; pair < keys.size(); ++pair) keys[pair] = normal_key(seed, pair);
  return keys;
}

}  // namespace merkel
