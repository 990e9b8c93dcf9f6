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
    requested_.reset();
  }

  enum class Turn { kWait, kRequest, kRequestAgain };
  /// Whether to send a request now; kRequestAgain: the previous one was not answered.
  Turn turn(std::chrono::nanoseconds now) noexcept {
    if (now < next()) return Turn::kWait;
    const Turn turn = requested_ ? Turn::kRequestAgain : Turn::kRequest;
    requested_ = now;
    due_ = due_ + period_ > now ? due_ + period_ : now + period_;
    return turn;
  }
  /// The time of the next call of turn().
  [[nodiscard]] std::chrono::nanoseconds next() const noexcept {
    return requested_ ? *requested_ + patience_ : due_;
  }
  /// Reports an answer. Returns the time of its request; empty if none was open.
  std::optional<std::chrono::nanoseconds> answered() noexcept {
    const auto requested = requested_;
    requested_.reset();
    return requested;
  }

 private:
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds patience_;
  std::chrono::nanoseconds due_{0};
  std::optional<std::chrono::nanoseconds> requested_;
};

}  // namespace merkel
