#pragma once

#include <chrono>
#include <concepts>

namespace merkel {

/// The loop's source of time and its only dependency on the host.
template <class C>
concept Clock = requires(C& clock, std::chrono::nanoseconds time) {
  /// The current time, host-monotonic.
  { clock.now() }
  noexcept->std::same_as<std::chrono::nanoseconds>;
  /// The processor time that the thread has used; only its differences have a meaning.
  { clock.processor_time() }
  noexcept->std::same_as<std::chrono::nanoseconds>;
  /// Returns at `time`, or at once if it has passed.
  { clock.wait_until(time) }
  noexcept;
  /// Called when a sample or room for a spike is missing. False: time has moved on, so count the
  /// miss. True: time stands still and other threads were given time to run, so check again.
  { clock.wait_for_others() }
  noexcept->std::same_as<bool>;
};

}  // namespace merkel
