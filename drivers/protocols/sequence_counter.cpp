#include "drivers/protocols/sequence_counter.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace merkel {
namespace {

constexpr std::uint32_t kLargestWindow = 64;
constexpr std::uint32_t kLargestLoss = 1U << 20U;  ///< a minute at 17 kHz
constexpr std::uint32_t kRestartRecords = 3;       ///< records of a restart or a large gap
constexpr std::uint32_t kNearRestartRecords =
    16;  ///< of a restart that may be a batch of late ones
constexpr std::uint32_t kJudgedSteps = 32;
constexpr std::uint32_t kMinJudged = 16;

}  // namespace

SequenceCounter::SequenceCounter(unsigned bits) noexcept
    : mask_(bits >= 32 ? 0xFFFFFFFFU : (1U << bits) - 1U),
      window_(std::min(kLargestWindow, (mask_ >> 3U) + 1U)) {}

void SequenceCounter::forget() noexcept {
  last_.reset();
  back_.reset();
  jump_.reset();
}

bool SequenceCounter::follows(std::uint32_t number, std::uint32_t previous) const noexcept {
  const std::uint32_t step = (number - previous) & mask_;
  return step != 0 && step <= window_;
}

/// Judges the last 32 steps.
bool SequenceCounter::makes_sense(bool in_order, DeviceStream& stream) {
  in_order_ = in_order_ << 1U | (in_order ? 1U : 0U);
  steps_ = std::min(steps_ + 1, kJudgedSteps);
  const auto good = static_cast<std::uint32_t>(std::popcount(in_order_));
  if (sense_ && steps_ >= kMinJudged && 4 * good < steps_) {
    sense_ = false;
    back_.reset();
    jump_.reset();
    stream.notice(
        "its sequence numbers make no sense: lost, late and repeated readings are not counted");
  } else if (!sense_ && 10 * good >= 9 * kJudgedSteps) {
    sense_ = true;
  }
  return sense_;
}

SequenceCounter::Step SequenceCounter::next(std::uint32_t number, DeviceStream& stream) {
  number &= mask_;
  const bool reopened = std::exchange(reopened_, false);
  if (!last_) {
    last_ = number;
    return {};
  }
  const std::uint32_t step = (number - *last_) & mask_;
  if (reopened && step != 0 && step <= mask_ / 2 && step <= kLargestLoss) {
    last_ = number;
    return {.lost = step - 1};
  }
  if (!makes_sense(follows(number, *last_), stream)) {
    last_ = number;
    return {};
  }
  const Step result = step == 0 ? Step{.duplicate = true}
                      : step <= std::max(mask_ / 2, window_)
                          ? forward(number, step)
                          : backward(number, (*last_ - number) & mask_);
  if (result.duplicate) ++stream.counts.duplicates;
  if (result.late) ++stream.counts.reordered;
  return result;
}

SequenceCounter::Step SequenceCounter::forward(std::uint32_t number, std::uint32_t step) noexcept {
  back_.reset();
  if (step > window_) {
    jump_ = Jump{.before = *last_, .lost = step - 1, .length = 1};
    last_ = number;
    return {};
  }
  last_ = number;
  Step result{.lost = step - 1};
  if (jump_ && ++jump_->length >= kRestartRecords) {
    if (jump_->lost < kLargestLoss) {
      result.lost += jump_->lost;
    } else {
      result.restarted = true;
    }
    jump_.reset();
  }
  return result;
}

SequenceCounter::Step SequenceCounter::backward(std::uint32_t number, std::uint32_t step) noexcept {
  if (jump_ && follows(number, jump_->before)) {  // the jump was one wrong number
    const std::uint32_t missing = ((number - jump_->before) & mask_) - 1;
    last_ = number;
    Step result{.lost = missing - std::min(missing, jump_->length)};
    jump_.reset();
    return result;
  }
  const bool goes_on = back_ && follows(number, back_->number);
  back_ = Run{.number = number, .length = goes_on ? back_->length + 1 : 1};
  if (back_->length < (step <= window_ ? kNearRestartRecords : kRestartRecords))
    return {.late = true};
  forget();
  last_ = number;
  return {.restarted = true};
}

}  // namespace merkel
