#include "drivers/clock/arrival_check.hpp"

#include <algorithm>

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kBack{2};   ///< largest step back between frames
constexpr milliseconds kLate{25};  ///< longest latency of a transport
constexpr milliseconds kPersistence{60};
constexpr std::uint32_t kMinWrongFrames = 3;  ///< that are wrong
constexpr int kCatchUp = 5;                   ///< a backlog must shrink by at least 1/5 of the time
constexpr milliseconds kGroup{10};            ///< frames that arrive within this time are one group
constexpr std::uint32_t kMinGroups = 2;       ///< whole groups that are late
constexpr milliseconds kFirstBatch{200};
constexpr milliseconds kSettledBatch{60};  ///< by which a batch can be earlier than all before

}  // namespace

void ArrivalCheck::restart() noexcept {
  last_good_.reset();
  wrong_.reset();
  late_.reset();
  batch_span_ = kFirstBatch;
}

bool ArrivalCheck::wrong_persists(Time arrival) noexcept {
  if (!wrong_) wrong_ = WrongFrames{.since = arrival};
  ++wrong_->frames;
  return wrong_->frames >= kMinWrongFrames && arrival - wrong_->since >= kPersistence;
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
    return wrong_persists(arrival) ? Arrival::kReanchor : Arrival::kOutlier;
  }
  wrong_.reset();
  last_good_ = std::max(*last_good_, estimate);
  if (lateness <= kLate) {
    late_.reset();
    return Arrival::kGood;
  }
  if (!late_) late_ = Late{.since = arrival, .group = arrival, .least = lateness};
  return late_persists(lateness, arrival) ? Arrival::kReanchor : Arrival::kGood;
}

bool ArrivalCheck::late_persists(Time lateness, Time arrival) noexcept {
  Late& late = *late_;
  if (arrival - late.group < kGroup) {
    late.least = std::min(late.least, lateness);
  } else {
    ++late.groups;
    if (late.least > late.peak) {
      late.peak = late.least;
      late.peak_at = late.group;
    }
    late.group = arrival;
    late.least = lateness;
  }
  if (late.groups < kMinGroups || arrival - late.since < kPersistence) return false;
  if ((late.peak - lateness) * kCatchUp < arrival - late.peak_at) return true;
  late_.reset();
  return false;
}

}  // namespace merkel
