#pragma once

#include <array>
#include <cstdint>

#include "drivers/protocols/device_reading.hpp"

namespace merkel {

// The wire format of a channel in a HELLO of HBF1.

enum class Hbf1Format : std::uint8_t { kInt16 = 0, kInt32 = 1, kFloat = 2 };

inline constexpr std::array<DeviceChannel, 8> kHbf1Kinds = {
    DeviceChannel::kForce, DeviceChannel::kForceX, DeviceChannel::kForceY, DeviceChannel::kForceZ,
    DeviceChannel::kDepth, DeviceChannel::kX,      DeviceChannel::kY,      DeviceChannel::kZ};
inline constexpr std::uint8_t kHbf1Newton = 1;
inline constexpr std::uint8_t kHbf1Millimetre = 2;
inline constexpr std::uint8_t kHbf1Micrometre = 3;
inline constexpr std::uint8_t kHbf1LastUnit = 4;

}  // namespace merkel
