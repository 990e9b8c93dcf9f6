#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

namespace merkel {

/// Bytes that passed a device's port together, and the parser's counts for them. Plain data that
/// crosses threads. A longer piece is split into several frames of the same time; the last one has
/// the counts.
struct RawFrame {
  enum class Kind : std::uint8_t {
    kReceived,  ///< from the device, unchanged
    kSent,      ///< to the device
    kOpened,    ///< no bytes: the port was opened or reopened; the parser restarts
    kStarted,   ///< no bytes: from here on, readings become samples
  };
  static constexpr std::size_t kMaxBytes = 64;

  std::chrono::nanoseconds time{0};  ///< host-monotonic: of arrival, or of the action
  std::uint32_t parsed = 0;          ///< complete, correct frames that end in these bytes
  std::uint32_t damaged = 0;         ///< frames that failed their check
  std::uint32_t lost = 0;            ///< missing, by sequence numbers or unanswered requests
  Kind kind = Kind::kReceived;
  std::uint8_t length = 0;  ///< used bytes
  std::array<std::uint8_t, kMaxBytes> bytes{};

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
