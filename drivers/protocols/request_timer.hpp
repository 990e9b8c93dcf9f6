#pragma once

#include <chrono>
#include <optional>

namespace merkel {

/// Schedules requests to a polled device: one at a time, at a steady rate, repeated if no answer
/// comes.
class RequestTimer {
 public:
  RequestTimer(std::chrono::nanoseconds period, std::chrono::nanoseconds patience) noexcept
      : period_(period), patience_(patience) {}

  void reset(std::chrono::nanoseconds now) noexcept {
    due_ = now;
    asked_.reset();
  }

  enum class Turn { kWait, kAsk, kAskAgain };
  /// Whether to send a request now; kAskAgain: the previous one was not answered.
  Turn turn(std::chrono::nanoseconds now) noexcept {
    if (now < next()) return Turn::kWait;
    const Turn turn = asked_ ? Turn::kAskAgain : Turn::kAsk;
    asked_ = now;
    due_ = due_ + period_ > now ? due_ + period_ : now + period_;
    return turn;
  }
  /// The time of the next call of turn().
  [[nodiscard]] std::chrono::nanoseconds next() const noexcept {
    return asked_ ? *asked_ + patience_ : due_;
  }
  /// Reports an answer. Returns the time of its request; empty if none was open.
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
