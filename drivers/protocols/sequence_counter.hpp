#pragma once

#include <cstdint>
#include <optional>

namespace merkel {

/// Counts gaps in a sequence of numbers that increase by one and wrap after `bits` bits.
class SequenceCounter {
 public:
  struct Step {
    std::uint32_t lost = 0;  ///< missing numbers before this one
    bool duplicate = false;  ///< the same number again
    bool restarted = false;  ///< the number went back: the sender has restarted
  };

  explicit SequenceCounter(unsigned bits) noexcept
      : mask_(bits >= 32 ? 0xFFFFFFFFU : (1U << bits) - 1U) {}

  /// Restarts with the next number.
  void forget() noexcept { last_.reset(); }

  Step next(std::uint32_t number) noexcept {
    number &= mask_;
    const std::optional<std::uint32_t> last = last_;
    last_ = number;
    if (!last) return {};
    const std::uint32_t step = (number - *last) & mask_;
    if (step == 0) return {.lost = 0, .duplicate = true};
    if (step > mask_ / 2) return {.lost = 0, .restarted = true};
    return {.lost = step - 1};
  }

 private:
  std::uint32_t mask_;
  std::optional<std::uint32_t> last_;
};

}  // namespace merkel
