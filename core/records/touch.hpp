#pragma once

#include <cstdint>
#include <string_view>

namespace merkel {

/// Whether a probe touches: decided once for each sample (realtime/input/contact_decision.hpp), and
/// recorded with samples and ticks.
enum class Touch : std::uint8_t {
  kUndecided,  ///< by nobody yet, or in a recording of an older version
  kFree,       ///< no contact
  kTouching,   ///< contact
  kTared,      ///< by a device: its first sample after a tare; then it is decided
  kZeroed,     ///< of a trace: the zero of its run is subtracted; then it is decided
};

/// Whether a sample with its zero subtracted is known to touch or not.
[[nodiscard]] constexpr bool is_decided(Touch touch) noexcept {
  return touch == Touch::kFree || touch == Touch::kTouching;
}

/// "undecided", "free", "touching", "tared", "zeroed".
[[nodiscard]] constexpr std::string_view name_of(Touch touch) noexcept {
  switch (touch) {
    case Touch::kUndecided:
      return "undecided";
    case Touch::kFree:
      return "free";
    case Touch::kTouching:
      return "touching";
    case Touch::kTared:
      return "tared";
    case Touch::kZeroed:
      return "zeroed";
  }
  return "";
}

}  // namespace merkel
