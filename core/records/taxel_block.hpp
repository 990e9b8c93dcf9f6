#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace merkel {

/// The pressures of some neighbouring taxels of a tactile array, as the loop used them for one
/// tick: plain data that crosses threads. Of a tick, only the blocks that changed since the tick
/// before are recorded (TickRecord::taxel_blocks); before the first, all pressures are 0.
struct TaxelBlock {
  static constexpr std::size_t kTaxels = 32;

  std::chrono::nanoseconds time{0};  ///< probe time of the tick's end
  std::uint64_t tick = 0;            ///< its number
  std::uint32_t probe = 0;           ///< from 0
  std::uint16_t first = 0;           ///< taxel, from 0; a multiple of kTaxels
  std::uint16_t count = 0;
  std::array<float, kTaxels> pressure_kPa{};
};

static_assert(std::is_trivially_copyable_v<TaxelBlock>);

/// The zeros of some neighbouring taxels of a device's array from one of its readings on, as
/// pressures that are subtracted from theirs. Of a reading, only the blocks that changed since the
/// one before are recorded; before the first, all zeros are 0. `tick` is 0.
struct TaxelZeros : TaxelBlock {};

}  // namespace merkel
