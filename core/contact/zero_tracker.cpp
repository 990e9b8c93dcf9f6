#include "core/contact/zero_tracker.hpp"

#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace merkel {
namespace {

constexpr double kMean_s = 0.1;
constexpr double kFast_s = 0.01;
constexpr double kFollow_s = 0.3;     ///< time constant of the zero
constexpr double kFollowDrift = 2.0;  ///< it follows this many times the largest drift
constexpr double kMoment_s = 0.05;    ///< between two moments
constexpr double kSettling_s = 0.5;   ///< at the start, the zero follows without limit
constexpr double kAtStart_s = 0.1;    ///< a contact that begins so early may be an offset
constexpr double kLookBack_s = 2.0;   ///< before the start of a contact
constexpr double kAbsorbing = 0.5;    ///< of the threshold: a mean above it may be a slow press
constexpr double kDrop_s = 0.5;
constexpr double kStill_s = 1.0;
constexpr double kStill = 0.25;         ///< of the threshold: the mean stays within
constexpr double kRisen = 0.65;         ///< of the threshold, within the look-back
constexpr double kGrace_s = 0.1;        ///< a contact that does not rise is certain for so long
constexpr double kZeroStep = 1.0 / 64;  ///< of the threshold: smaller changes wait

}  // namespace

ZeroTracker::ZeroTracker(double threshold, double drift_per_s, bool known) noexcept
    : threshold_(threshold), drift_per_s_(drift_per_s), known_zero_(known) {}

void ZeroTracker::reset() noexcept { *this = ZeroTracker(threshold_, drift_per_s_, true); }

bool ZeroTracker::uncertain() const noexcept {
  return touching_ &&
         (began_s_ < kAtStart_s || doubtful_ || (!risen_ && now_s_ - began_s_ >= kGrace_s));
}

/// The newest moment whose mean was within `level` of its zero, or else the one that is at least so
/// long ago, or the oldest.
const ZeroTracker::Moment& ZeroTracker::before(double duration_s, double level) const noexcept {
  for (std::size_t back = 0;; ++back) {
    const Moment& moment = moments_[(newest_ + kMoments - back) % kMoments];
    if (back + 1 >= known_ || moment.time_s <= now_s_ - duration_s) return moment;
    if (moment.mean - moment.zero < level) return moment;
  }
}

void ZeroTracker::remember() noexcept {
  if (known_ > 0 && now_s_ - moments_[newest_].time_s < kMoment_s) return;
  newest_ = (newest_ + 1) % kMoments;
  known_ = std::min(known_ + 1, kMoments);
  moments_[newest_] = {.time_s = now_s_, .zero = zero_, .mean = mean_};
}

void ZeroTracker::set_zero(double zero) noexcept { exact_ = zero_ = zero; }

double ZeroTracker::follow(std::chrono::nanoseconds time, double reading) noexcept {
  if (!started_) {
    started_ = true;
    origin_ = time;
    mean_ = fast_ = reading;
    if (!known_zero_ && std::fabs(reading) < threshold_) set_zero(reading);
    remember();
    return zero_;
  }
  const double last_s = now_s_;
  now_s_ = units::s_from(time - origin_);
  const double step_s = now_s_ - last_s;
  mean_ += (reading - mean_) * step_s / (kMean_s + step_s);
  fast_ += (reading - fast_) * step_s / (kFast_s + step_s);
  if (touching_) {
    watch_contact();
  } else {
    const bool settles = !known_zero_ && now_s_ < kSettling_s && std::fabs(mean_) < threshold_;
    const double most = settles ? threshold_ : kFollowDrift * drift_per_s_ * step_s;
    exact_ += std::clamp((mean_ - exact_) * std::min(step_s / kFollow_s, 1.0), -most, most);
    if (std::fabs(exact_ - zero_) >= kZeroStep * threshold_) zero_ = exact_;
  }
  remember();
  return zero_;
}

double ZeroTracker::begin_contact() noexcept {
  set_zero(std::min(zero_, before(kLookBack_s, kAbsorbing * threshold_).zero));
  touching_ = true;
  began_s_ = still_since_s_ = now_s_;
  level_ = mean_;
  hold_ = 0.0;
  risen_ = dropped_ = fell_ = doubtful_ = false;
  return zero_;
}

void ZeroTracker::watch_contact() noexcept {
  const Moment& long_ago = before(kLookBack_s);
  const Moment& ago = before(kDrop_s);
  const double above = mean_ - zero_;
  const double was_above = ago.mean - zero_;
  if (ago.time_s >= began_s_) hold_ = std::max(hold_, was_above);
  risen_ = risen_ || fast_ - long_ago.mean >= kRisen * threshold_;
  const bool rises = fell_ && mean_ - long_ago.mean >= threshold_;
  if (rises) hold_ = above;
  if (rises || above >= 0.5 * hold_) dropped_ = fell_ = doubtful_ = false;
  if (above < 0.5 * hold_ && long_ago.mean - mean_ >= threshold_) {
    fell_ = true;
    fell_at_s_ = now_s_;
  }
  dropped_ = dropped_ || (was_above > 2.0 * threshold_ && above < 0.5 * was_above);
  if (std::fabs(mean_ - level_) >= kStill * threshold_) {
    level_ = mean_;
    still_since_s_ = now_s_;
  }
  if (!fell_ || now_s_ - still_since_s_ < kStill_s) return;
  const double drift = drift_per_s_ * (fell_at_s_ - began_s_);
  doubtful_ = above <= kDoubt * drift;
  if (!dropped_ || above > drift) return;
  set_zero(mean_);
  known_ = 0;  // the zeros before it are those of another drift
  remember();
}

}  // namespace merkel
