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
};

/// "undecided", "free", "touching", "tared".
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
  }
  return "";
}

}  // namespace merkel
