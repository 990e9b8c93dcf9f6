#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "drivers/protocols/hbf1_frame.hpp"

namespace merkel {

/// The host's SYNC requests to the clock of an HBF1 device: eight in a row, then eight each second.
class Hbf1Sync {
 public:
  using Time = std::chrono::nanoseconds;

  /// The port was opened or reopened.
  void begin(Time now) noexcept {
    requests_ = 0;
    due_ = now;
  }
  /// When to send the next request.
  [[nodiscard]] Time due() const noexcept { return due_; }
  /// The body of a request that is sent now.
  [[nodiscard]] Bytes request(Time now) {
    constexpr std::chrono::milliseconds kRound{1000};
    constexpr std::chrono::milliseconds kSpacing{3};
    due_ = now + (++requests_ % kRequestsARound == 0 ? kRound : kSpacing);
    sent_[next_token_ % sent_.size()] = {next_token_, now};
    Bytes token;
    append_u32(next_token_++, token);
    return token;
  }
  /// The times of a request and its answer; empty for a request of an earlier session.
  /// \param frame  with a body of 8 bytes
  [[nodiscard]] std::optional<ClockExchange> answer(const Hbf1Frame& frame, Time arrival) noexcept {
    const std::uint32_t token = read_u32(frame.body.first<4>());
    Sent& sent = sent_[token % sent_.size()];
    if (sent.token != token || sent.time == Time{0}) return std::nullopt;
    ++answers_;
    return ClockExchange{
        .sent = std::exchange(sent.time, Time{0}),
        .received = arrival,
        .device_received = std::chrono::microseconds{read_u32(frame.body.subspan<4, 4>())},
        .device_sent = std::chrono::microseconds{frame.header.time_us}};
  }
  /// True if a round was answered: the device's clock is known.
  [[nodiscard]] bool answered() const noexcept { return answers_ >= kRequestsARound; }

 private:
  static constexpr int kRequestsARound = 8;
  struct Sent {
    std::uint32_t token = 0;
    Time time{0};
  };
  std::array<Sent, 32> sent_{};
  std::uint32_t next_token_ = 1;
  int requests_ = 0;
  int answers_ = 0;
  Time due_{0};
};

}  // namespace merkel
