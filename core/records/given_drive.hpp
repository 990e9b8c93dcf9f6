#pragma once

#include <chrono>
#include <cstdint>
#include <type_traits>

namespace merkel {

/// A drive that was given to an electrode whose encoder is `own`, and to its group: plain data that
/// crosses threads.
struct GivenDrive {
  std::chrono::nanoseconds time{0};  ///< probe time: the end of the first tick that has it
  double amplitude = 0.0;            ///< of the electrode's range: 0 (off) to 1 (strongest)
  double frequency = 0.0;            ///< the same
  std::uint16_t electrode = 0;       ///< from 0, in the order of the scene

  friend bool operator==(const GivenDrive&, const GivenDrive&) = default;
};

static_assert(std::is_trivially_copyable_v<GivenDrive>);

}  // namespace merkel
