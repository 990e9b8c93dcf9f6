#pragma once

#include <cstdint>
#include <optional>

namespace merkel {

/// Counts what is missing in a stream of numbers that go up by one and wrap after `bits` bits.
class SequenceCounter {
 public:
  struct Step {
    std::uint32_t lost = 0;  ///< numbers left out before this one
    bool duplicate = false;  ///< this number again
    bool restarted = false;  ///< it has gone back: whoever counts has started anew
  };

  explicit SequenceCounter(unsigned bits) noexcept
      : mask_(bits >= 32 ? 0xFFFFFFFFU : (1U << bits) - 1U) {}

  /// The next number is the first again.
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
