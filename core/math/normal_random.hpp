#pragma once

#include <cstdint>

namespace merkel {

/// The number of a pair of normal streams that share one word a step, and which of both it is.
/// Neighbours eight apart are a pair, so that a vector of neurons finds its partners in another.
struct NormalStream {
  static constexpr std::uint64_t kDistance = 8;
  std::uint64_t pair;
  bool second;

  [[nodiscard]] static constexpr NormalStream of(std::uint64_t number) noexcept {
    return {.pair = number / (2 * kDistance) * kDistance + number % kDistance,
            .second = number % (2 * kDistance) >= kDistance};
  }
};

/// Where a pair's SplitMix64 sequence begins.
[[nodiscard]] std::uint64_t normal_key(std::uint64_t seed, std::uint64_t pair) noexcept;

/// Taylor coefficients of sin(f)/f and of cos(f) in powers of f², from the highest.
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

/// A standard normal number that depends on nothing but a seed, the number of a stream (an
/// afferent, from 0) and the number of a step: no order of evaluation, chunk or vector width can
/// change it. By Box and Muller from word `step` of the pair's SplitMix64 sequence; from +, −, ×, ÷
/// and √ alone, so that every machine gives the same bits. Real-time: yes.
///
/// The neuron kernels compute the same (neurons/noisy_steps-inl.hpp), to the last bit.
[[nodiscard]] double normal_random(std::uint64_t seed, std::uint64_t stream,
                                   std::uint64_t step) noexcept;

}  // namespace merkel
