#pragma once

#include <chrono>
#include <optional>

namespace merkel {

/// When a device that answers questions is to be asked: one question at a time, at a steady rate,
/// and again if no answer comes.
class RequestTimer {
 public:
  RequestTimer(std::chrono::nanoseconds period, std::chrono::nanoseconds patience) noexcept
      : period_(period), patience_(patience) {}

  void reset(std::chrono::nanoseconds now) noexcept {
    due_ = now;
    asked_.reset();
  }

  enum class Turn { kWait, kAsk, kAskAgain };
  /// Whether to ask now; kAskAgain: the question before was never answered.
  Turn turn(std::chrono::nanoseconds now) noexcept {
    if (now < next()) return Turn::kWait;
    const Turn turn = asked_ ? Turn::kAskAgain : Turn::kAsk;
    asked_ = now;
    due_ = due_ + period_ > now ? due_ + period_ : now + period_;
    return turn;
  }
  /// When turn() is to be asked again.
  [[nodiscard]] std::chrono::nanoseconds next() const noexcept {
    return asked_ ? *asked_ + patience_ : due_;
  }
  /// An answer has come. Returns when its question was asked; nothing, if none was open.
  std::optional<std::chrono::nanoseconds> answered() noexcept {
    const auto asked = asked_;
    asked_.reset();
    return asked;
  }

 private:
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds patience_;
  std::chrono::nanoseconds due_{0};
  std::optional<std::chrono::nanoseconds> asked_;
};

}  // namespace merkel
