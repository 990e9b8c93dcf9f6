#pragma once

#include <array>
#include <cstdint>

#include "drivers/protocols/device_reading.hpp"

namespace merkel {

// The wire format of a channel in a HELLO of HBF1 (drivers/protocols/README.md#hbf1).

enum class Hbf1Format : std::uint8_t { kInt16 = 0, kInt32 = 1, kFloat = 2 };

inline constexpr std::array<DeviceChannel, 8> kHbf1Kinds = {
    DeviceChannel::kForce, DeviceChannel::kForceX, DeviceChannel::kForceY, DeviceChannel::kForceZ,
    DeviceChannel::kDepth, DeviceChannel::kX,      DeviceChannel::kY,      DeviceChannel::kZ};
inline constexpr std::uint8_t kHbf1FirstLength = 4;  ///< kinds below it are forces
inline constexpr std::uint8_t kHbf1Pressure = 10;    ///< always has a name; 8, 9: not used
inline constexpr std::uint8_t kHbf1LastKind = 10;

inline constexpr std::uint8_t kHbf1Raw = 0;
inline constexpr std::uint8_t kHbf1Newton = 1;
inline constexpr std::uint8_t kHbf1Millimetre = 2;
inline constexpr std::uint8_t kHbf1Micrometre = 3;
inline constexpr std::uint8_t kHbf1Kilopascal = 5;
inline constexpr std::uint8_t kHbf1LastUnit = 5;

/// True for a character that the name of a channel may have.
[[nodiscard]] constexpr bool is_in_hbf1_name(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-';
}

}  // namespace merkel
