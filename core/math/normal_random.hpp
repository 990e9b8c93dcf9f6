#pragma once

#include <cstdint>

namespace merkel {

/// The index of a pair of normal streams that share one random word per step, and which stream of
/// the pair it is. Streams eight apart form a pair, so that the partners of one vector of neurons
/// lie in another.
struct NormalStream {
  static constexpr std::uint64_t kDistance = 8;
  std::uint64_t pair;
  bool second;

  [[nodiscard]] static constexpr NormalStream of(std::uint64_t number) noexcept {
    return {.pair = number / (2 * kDistance) * kDistance + number % kDistance,
            .second = number % (2 * kDistance) >= kDistance};
  }
};

/// Start of a pair's SplitMix64 sequence.
[[nodiscard]] std::uint64_t normal_key(std::uint64_t seed, std::uint64_t pair) noexcept;

/// Taylor coefficients of sin(f)/f and of cos(f) in powers of f², highest power first.
inline constexpr double kSineSeries[] = {
    -1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0, 1.0 / 362880.0,
    -1.0 / 5040.0,          1.0 / 120.0,        -1.0 / 6.0,        1.0};
inline constexpr double kCosineSeries[] = {1.0 / 20922789888000.0,
                                           -1.0 / 87178291200.0,
                                           1.0 / 479001600.0,
                                           -1.0 / 3628800.0,
                                           1.0 / 40320.0,
                                           -1.0 / 720.0,
                                           1.0 / 24.0,
                                           -0.5,
                                           1.0};

/// A standard normal number that depends only on a seed, the number of a stream (an afferent, from
/// 0) and the number of a step. Evaluation order, chunks and vector width do not change it.
/// Box-Muller transform of word `step` of the pair's SplitMix64 sequence, using only +, −, ×, ÷ and
/// √, so every machine gives the same bits. Real-time: yes.
///
/// The neuron kernels compute identical bits (neurons/noisy_steps-inl.hpp).
[[nodiscard]] double normal_random(std::uint64_t seed, std::uint64_t stream,
                                   std::uint64_t step) noexcept;

}  // namespace merkel
