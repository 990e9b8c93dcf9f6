#pragma once

#include <cstdint>

namespace merkel {

/// The project's own random generator: SplitMix64 (Steele, Lea & Flood 2014, OOPSLA, "Fast
/// splittable pseudorandom number generators"). The same seed gives the same numbers on every
/// compiler, library and machine; the std:: distributions do not guarantee this.
/// Real-time: yes.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) noexcept : state_(seed) {}

  /// Increment of the state per word: word k of a seed is mix(seed + (k+1)·increment).
  static constexpr std::uint64_t kIncrement = 0x9e3779b97f4a7c15U;

  constexpr std::uint64_t next() noexcept {
    state_ += kIncrement;
    return mix(state_);
  }

  /// Uniform in [0, 1), a multiple of 2⁻⁵³.
  constexpr double uniform() noexcept { return static_cast<double>(next() >> 11U) * 0x1.0p-53; }

  /// Uniform in [low, high).
  constexpr double uniform(double low, double high) noexcept {
    return low + (high - low) * uniform();
  }

  /// The output function: a bijection of 64-bit words that turns counters into random words.
  static constexpr std::uint64_t mix(std::uint64_t z) noexcept {
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }

 private:
  std::uint64_t state_;
};

}  // namespace merkel
