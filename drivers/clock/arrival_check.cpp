#include "drivers/clock/arrival_check.hpp"

#include <algorithm>

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kBack{2};   ///< largest step back between frames
constexpr milliseconds kLate{25};  ///< longest latency of a transport
constexpr milliseconds kPersistence{60};
constexpr std::uint32_t kFewestFrames = 3;  ///< shortest run, in frames
constexpr int kCatchUp = 5;                 ///< a backlog must shrink by at least 1/5 of the time
constexpr milliseconds kFirstBatch{200};
constexpr milliseconds kSettledBatch{60};  ///< by which a batch can be earlier than all before

}  // namespace

void ArrivalCheck::restart() noexcept {
  last_good_.reset();
  wrong_.reset();
  late_.reset();
  batch_span_ = kFirstBatch;
}

bool ArrivalCheck::goes_on(std::optional<Run>& run, Time lateness, Time arrival) noexcept {
  if (!run) run = Run{.since = arrival, .lateness = lateness};
  ++run->frames;
  return run->frames >= kFewestFrames && arrival - run->since >= kPersistence;
}

ArrivalCheck::Arrival ArrivalCheck::check(Time estimate, Time arrival, Time tolerance,
                                          bool settled) noexcept {
  if (arrival != last_arrival_) {
    if (last_good_) batch_span_ = arrival - last_arrival_;
    last_arrival_ = arrival;
  }
  if (!last_good_) {
    last_good_ = estimate;
    return Arrival::kGood;
  }
  const Time lateness = arrival - estimate;
  // All frames of a batch were measured after the previous batch. A later frame of the batch can
  // show that the first one was late.
  const bool early = lateness < -tolerance && estimate > *last_good_ + batch_span_ + tolerance;
  const Time impossible = settled ? kSettledBatch : kFirstBatch;
  if (early || lateness < -std::max<Time>(impossible, tolerance) ||
      estimate < *last_good_ - kBack) {
    late_.reset();
    return goes_on(wrong_, lateness, arrival) ? Arrival::kReanchor : Arrival::kOutlier;
  }
  wrong_.reset();
  last_good_ = std::max(*last_good_, estimate);
  if (lateness <= kLate) {
    late_.reset();
    return Arrival::kGood;
  }
  // Later by so much than the first late frame: a stall, whose backlog begins with this frame.
  if (late_ && lateness > late_->lateness + kLate) late_.reset();
  if (!goes_on(late_, lateness, arrival)) return Arrival::kGood;
  const Time caught_up = late_->lateness - lateness;
  if (caught_up * kCatchUp < arrival - late_->since) return Arrival::kReanchor;
  late_.reset();
  return Arrival::kGood;
}

}  // namespace merkel
