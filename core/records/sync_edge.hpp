#pragma once

#include <chrono>
#include <cstdint>
#include <type_traits>

namespace merkel {

/// An edge of a sync line, which a device and another recorder share: plain data that crosses
/// threads.
struct SyncEdge {
  std::chrono::nanoseconds time{0};  ///< probe time
  std::uint32_t probe = 0;           ///< the first one that the device feeds, from 0
  std::uint16_t line = 1;            ///< of the device, from 1
  std::uint16_t level = 0;           ///< 1: high from here on; 0: low

  friend bool operator==(const SyncEdge&, const SyncEdge&) = default;
};

static_assert(std::is_trivially_copyable_v<SyncEdge>);

}  // namespace merkel
