#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

namespace merkel {

/// Bytes that went over a device's port at once, and what its parser found in them: plain data that
/// crosses threads. More bytes than fit are several frames of the same time, of which the last has
/// the counts.
struct RawFrame {
  enum class Kind : std::uint8_t {
    kReceived,  ///< from the device, as they came
    kSent,      ///< to the device
    kOpened,    ///< no bytes: the port was opened, or opened again; the parser begins anew
    kStarted,   ///< no bytes: from here on readings become samples
  };
  static constexpr std::size_t kMostBytes = 64;

  std::chrono::nanoseconds time{0};  ///< host-monotonic: of arrival, or when it was done
  std::uint32_t parsed = 0;          ///< whole and correct frames that ended with these bytes
  std::uint32_t damaged = 0;         ///< frames that failed their check
  std::uint32_t lost = 0;            ///< found missing, by numbers or unanswered questions
  Kind kind = Kind::kReceived;
  std::uint8_t length = 0;  ///< of the bytes
  std::array<std::uint8_t, kMostBytes> bytes{};

  [[nodiscard]] std::span<const std::uint8_t> content() const noexcept {
    return std::span(bytes).first(length);
  }
  friend bool operator==(const RawFrame&, const RawFrame&) = default;
};

static_assert(std::is_trivially_copyable_v<RawFrame>);

/// "received", "sent", "opened", "started".
[[nodiscard]] constexpr std::string_view name_of(RawFrame::Kind kind) noexcept {
  switch (kind) {
    case RawFrame::Kind::kReceived:
      return "received";
    case RawFrame::Kind::kSent:
      return "sent";
    case RawFrame::Kind::kOpened:
      return "opened";
    case RawFrame::Kind::kStarted:
      return "started";
  }
  return "";
}

}  // namespace merkel
