#pragma once

#include <chrono>
#include <concepts>

namespace merkel {

/// Where the loop's time comes from. The loop asks nothing else of the outside world.
template <class C>
concept Clock = requires(C& clock, std::chrono::nanoseconds time) {
  /// Now, host-monotonic.
  { clock.now() }
  noexcept->std::same_as<std::chrono::nanoseconds>;
  /// Returns at `time`, or at once if it has passed.
  { clock.wait_until(time) }
  noexcept;
  /// Called when the loop lacks a sample, or room for a spike. False: time goes on, so count the
  /// miss. True: time stands still, other threads were given a moment, so look again.
  { clock.wait_for_others() }
  noexcept->std::same_as<bool>;
};

}  // namespace merkel
