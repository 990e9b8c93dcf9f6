#pragma once

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/units.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {

/// The quantities that a device can measure: forces in N (compression is positive), lengths in mm.
/// A device may have further channels with names of its own, such as thumb_N: named_channel().
enum class DeviceChannel : std::uint16_t {
  kForce,   ///< along the probe's axis
  kForceX,  ///< from a multi-axis sensor
  kForceY,
  kForceZ,
  kDepth,  ///< indentation depth
  kX,      ///< from a stage, in its work coordinates
  kY,
  kZ,
};
inline constexpr std::size_t kDeviceChannels = 8;
inline constexpr std::array<std::string_view, kDeviceChannels> kDeviceChannelNames = {
    "force", "force_x", "force_y", "force_z", "depth", "x", "y", "z"};

/// The channels of a device that correspond to those of a sample, in the order of kProbeChannels.
inline constexpr std::array<DeviceChannel, 4> kPressChannels = {
    DeviceChannel::kDepth, DeviceChannel::kForce, DeviceChannel::kX, DeviceChannel::kY};

/// The channels with names of their own, numbered from 0.
[[nodiscard]] constexpr DeviceChannel named_channel(std::size_t number) noexcept {
  return static_cast<DeviceChannel>(kDeviceChannels + number);
}
[[nodiscard]] constexpr bool is_named(DeviceChannel channel) noexcept {
  return static_cast<std::size_t>(channel) >= kDeviceChannels;
}

/// 0 for a channel with a name of its own.
[[nodiscard]] constexpr std::uint32_t bit_of(DeviceChannel channel) noexcept {
  return is_named(channel) ? 0U : 1U << static_cast<std::uint32_t>(channel);
}

/// The content of one frame of a device, in N and mm, before calibration.
struct DeviceReading {
  std::array<double, kDeviceChannels> values{};
  std::uint32_t channels = 0;  ///< the values that are set: bit_of(channel)
  /// Of the channels with names of their own; NaN where the device has no value.
  std::vector<double> named;
  std::uint32_t lost = 0;   ///< frames lost before this one, by sequence numbers
  bool saturated = false;   ///< a value is at the limit of its format
  bool rebooted = false;    ///< the device has restarted since its last reading
  bool wrong_time = false;  ///< the transmitted time cannot be a time; device_time is not set
  /// By the device's clock, as transmitted; it may wrap (Protocol::clock_wrap).
  std::optional<std::chrono::nanoseconds> device_time;
  /// Time of reading its last byte, host-monotonic.
  std::chrono::nanoseconds arrival{0};
  /// Time of its request, host-monotonic; not set for a device that streams.
  std::optional<std::chrono::nanoseconds> requested;

  void set(DeviceChannel channel, double value) {
    const auto place = static_cast<std::size_t>(channel);
    if (is_named(channel)) {
      const std::size_t number = place - kDeviceChannels;
      if (named.size() <= number) named.resize(number + 1, std::nan(""));
      named[number] = value;
      return;
    }
    values[place] = value;
    channels |= bit_of(channel);
  }
  /// Sets the device time, or `wrong_time`: a time that cannot be one costs the time, not the
  /// reading.
  void set_time(double time_ns) noexcept {
    // 146 years: beyond, differences of times overflow.
    constexpr double kFarthest_ns = 4.6e18;
    wrong_time = !(time_ns > -kFarthest_ns && time_ns < kFarthest_ns);
    if (!wrong_time) device_time = std::chrono::nanoseconds{std::llround(time_ns)};
  }
  [[nodiscard]] bool has(DeviceChannel channel) const noexcept {
    return (channels & bit_of(channel)) != 0U;
  }
  /// NaN if it is not set.
  [[nodiscard]] double operator[](DeviceChannel channel) const noexcept {
    const auto place = static_cast<std::size_t>(channel);
    if (!is_named(channel)) return has(channel) ? values[place] : std::nan("");
    const std::size_t number = place - kDeviceChannels;
    return number < named.size() ? named[number] : std::nan("");
  }
};

/// True if all values of the known quantities are finite and within SampleLimits. The probe that
/// uses a channel with a name of its own checks it.
[[nodiscard]] inline bool plausible(const DeviceReading& reading) noexcept {
  for (std::size_t i = 0; i < kDeviceChannels; ++i) {
    const double limit =
        i <= static_cast<std::size_t>(DeviceChannel::kForceZ)
            ? units::N_from_mN(SampleLimits::kForce_mN)
            : (i == static_cast<std::size_t>(DeviceChannel::kDepth) ? SampleLimits::kDepth_mm
                                                                    : SampleLimits::kPosition_mm);
    if (!plausible(reading.values[i], limit)) return false;
  }
  return true;
}

}  // namespace merkel
