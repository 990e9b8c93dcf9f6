#pragma once

#include <chrono>
#include <cstdint>
#include <type_traits>

namespace merkel {

/// What one probe measured in a reading of its device (Readings): plain data that crosses threads.
///
/// Fields whose bit in `channels` is not set are 0 and unused. Every field is finite: the driver
/// rejects non-finite readings.
struct ProbeSample {
  /// The channels of a sample.
  enum Channel : std::uint32_t {
    kDepth = 1U << 0U,  ///< indentation depth
    kForce = 1U << 1U,  ///< normal force
    kX = 1U << 2U,      ///< position on the patch along the finger
    kY = 1U << 3U,      ///< position on the patch across it
  };

  /// Acquisition time: host-monotonic for a device, the recording's own time for a replayed trace.
  std::chrono::nanoseconds time{0};
  /// When the sample reached the host, on the clock of `time`; equal to `time` in a replay.
  std::chrono::nanoseconds arrival{0};
  double depth_mm = 0.0;       ///< indentation depth; ≤ 0: no contact
  double force_mN = 0.0;       ///< compressive force; ≤ 0: no contact
  double x_mm = 0.0;           ///< patch coordinate from the fingertip
  double y_mm = 0.0;           ///< patch coordinate across the finger
  std::uint32_t sequence = 0;  ///< counts samples from the device, including lost ones
  std::uint32_t channels = 0;  ///< Channel bits
  /// How long the sample is held if no other follows; then the probe is released. 0: without limit.
  std::chrono::nanoseconds valid_for{0};

  [[nodiscard]] bool has(Channel channel) const noexcept { return (channels & channel) != 0U; }
};

static_assert(std::is_trivially_copyable_v<ProbeSample>);

}  // namespace merkel
