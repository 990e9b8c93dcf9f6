#pragma once

#include <chrono>
#include <cstdint>
#include <type_traits>

#include "core/records/touch.hpp"

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
  /// Reasons to doubt what a probe measures: bits of doubts(). A probe sets them in every sample
  /// that they concern. While the sample in effect has one, the electrodes of the probe's patch are
  /// suspended, with that reason (StimulationCommand::Stop).
  enum Doubt : std::uint8_t {
    kZeroUncertain = 1U << 0U,       ///< its zero may have moved
    kOutsideCalibration = 1U << 1U,  ///< beyond the range of its calibration
    kAllDoubts = kZeroUncertain | kOutsideCalibration,
  };

  /// Acquisition time: host-monotonic for a device, the recording's own time for a replayed trace.
  std::chrono::nanoseconds time{0};
  /// When the sample reached the host, on the clock of `time`; equal to `time` in a replay.
  std::chrono::nanoseconds arrival{0};
  double depth_mm = 0.0;       ///< indentation depth; ≤ 0: no contact
  double force_mN = 0.0;       ///< compressive force above its zero; ≤ 0: no contact
  double x_mm = 0.0;           ///< patch coordinate from the fingertip
  double y_mm = 0.0;           ///< patch coordinate across the finger
  std::uint32_t sequence = 0;  ///< counts samples from the device, including lost ones
  std::uint32_t channels = 0;  ///< Channel bits; from kDoubtShift, Doubt bits
  /// How long the sample is held if no other follows; then the probe is released. 0: without limit.
  std::chrono::nanoseconds valid_for{0};
  double zero_mN = 0.0;  ///< that was subtracted from the calibrated force
  Touch touch = Touch::kUndecided;

  [[nodiscard]] bool has(Channel channel) const noexcept { return (channels & channel) != 0U; }
  [[nodiscard]] std::uint8_t doubts() const noexcept {
    return static_cast<std::uint8_t>(channels >> kDoubtShift & kAllDoubts);
  }
  void set_doubts(std::uint32_t doubts) noexcept {
    channels = (channels & ((1U << kDoubtShift) - 1U)) | (doubts & kAllDoubts) << kDoubtShift;
  }

  static constexpr std::uint32_t kDoubtShift = 8;
};

static_assert(std::is_trivially_copyable_v<ProbeSample>);

/// Whether a sample touches; if that is undecided, by any positive depth or force.
[[nodiscard]] constexpr bool touches(const ProbeSample& sample) noexcept {
  return is_decided(sample.touch) ? sample.touch == Touch::kTouching
                                  : sample.depth_mm > 0.0 || sample.force_mN > 0.0;
}

}  // namespace merkel
