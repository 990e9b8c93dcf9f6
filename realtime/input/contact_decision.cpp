#include "realtime/input/contact_decision.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/units.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kEndOfContact{10};
constexpr std::chrono::milliseconds kStartZero{500};
constexpr std::chrono::seconds kSecond{1};
constexpr int kRestSeconds = 10;

}  // namespace

ContactDecision::ContactDecision(const Parameters& parameters, bool recorded) noexcept
    : parameters_(parameters),
      zero_(parameters.zero.value_or(recorded ? Zero::kFixed : Zero::kTrack)),
      tracker_(units::mN_from_N(parameters.contact_N), parameters.zero_drift_mN_per_s) {
  if (zero_ == Zero::kTrack && !(parameters.contact_N > 0.0)) zero_ = Zero::kFixed;
}

/// The zero of a sample without one, positive in the direction of compression.
double ContactDecision::zero_of(const ProbeSample& sample, double force_mN) noexcept {
  if (zero_ == Zero::kTrack) {
    tracker_.follow(sample.time, force_mN);
    const bool begins = !touching_ && reaches(sample, force_mN - tracker_.zero(), 1.0);
    return begins ? tracker_.begin_contact() : tracker_.zero();
  }
  if (zero_ == Zero::kFixed) return 0.0;
  if (!began_) began_ = sample.time;
  if (!started_ && sample.time - *began_ < kStartZero) {
    sum_mN_ += force_mN;
    ++summed_;
    return force_mN;  // nothing touches yet
  }
  started_ = true;
  return summed_ > 0 ? sum_mN_ / static_cast<double>(summed_) : 0.0;
}

bool ContactDecision::reaches(const ProbeSample& sample, double force_mN,
                              double share) const noexcept {
  const bool force = sample.has(ProbeSample::kForce);
  const bool by_depth = sample.has(ProbeSample::kDepth) &&
                        (parameters_.control == Indenter::Control::kDepth || !force);
  const double least_mN = share * units::mN_from_N(parameters_.contact_N);
  const double least_mm = share * parameters_.contact_mm;
  if (force && parameters_.contact_N > 0.0 && force_mN < least_mN) return false;
  if (by_depth && sample.depth_mm < least_mm) return false;
  return (by_depth ? sample.depth_mm : force_mN) > 0.0;
}

void ContactDecision::start_anew() noexcept {
  tracker_.reset();
  touching_ = false;
  started_ = true;
  summed_ = 0;
}

void ContactDecision::decide(ProbeSample& sample) noexcept {
  const double sign = parameters_.invert_force ? -1.0 : 1.0;
  if (sample.touch == Touch::kTared) start_anew();
  const bool has_zero = is_decided(sample.touch) || sample.touch == Touch::kZeroed;
  if (!has_zero && sample.has(ProbeSample::kForce)) {
    sample.zero_mN = sign * zero_of(sample, sign * sample.force_mN);
    sample.force_mN -= sample.zero_mN;
  }
  const double force_mN = sign * sample.force_mN;
  if (reaches(sample, force_mN, touching_ ? 0.5 : 1.0)) {
    touching_ = true;
    reached_ = sample.time;
  } else if (touching_) {
    touching_ = parameters_.has_threshold() && sample.time - reached_ < kEndOfContact;
    if (!touching_) tracker_.end_contact();
  }
  sample.touch = touching_ ? Touch::kTouching : Touch::kFree;
  if (tracker_.uncertain()) sample.set_doubts(sample.doubts() | ProbeSample::kZeroUncertain);
  follow_drift(sample, force_mN);
}

ContactDecision::Drift ContactDecision::drift() const noexcept {
  if (drift_.followed) return drift_;
  const double sign = parameters_.invert_force ? -1.0 : 1.0;
  return {.first_mN = sign * rest_.first_mN,
          .last_mN = sign * rest_.last_mN,
          .first = rest_.first,
          .last = rest_.last,
          .uncertain = drift_.uncertain};
}

void ContactDecision::follow_drift(const ProbeSample& sample, double force_mN) noexcept {
  const bool uncertain = (sample.doubts() & ProbeSample::kZeroUncertain) != 0U;
  if (any_) {
    if (uncertain) drift_.uncertain += sample.time - previous_;
    // That of kStart is its force during its first 0.5 s, and then stays.
    const bool settled = zero_ != Zero::kStart && sample.time - drift_.first > kStartZero;
    drift_.followed = drift_.followed || (settled && sample.zero_mN != drift_.last_mN);
  } else {
    drift_.first_mN = sample.zero_mN;
    drift_.first = second_began_ = level_time_ = sample.time;
    any_ = true;
  }
  previous_ = drift_.last = sample.time;
  drift_.last_mN = sample.zero_mN;
  if (!drift_.followed && sample.has(ProbeSample::kForce)) follow_rest(sample, force_mN);
}

void ContactDecision::follow_rest(const ProbeSample& sample, double force_mN) noexcept {
  if (sample.time - second_began_ >= kSecond && second_count_ > 0.0) end_second(sample.time);
  second_sum_ += force_mN;
  second_count_ += 1.0;
  second_touched_ = second_touched_ || touching_;
}

/// A second with a touch is at rest while drift alone explains its level. After a press, the level
/// must have fallen, so that a long press does not become drift.
void ContactDecision::end_second(std::chrono::nanoseconds time) noexcept {
  const double mean = second_sum_ / second_count_;
  const double per_s = ZeroTracker::kDoubt * parameters_.zero_drift_mN_per_s;
  const bool explained = std::fabs(mean - level_) <= per_s * units::s_from(time - level_time_);
  const bool fell = second_mean_ - mean > per_s * units::s_from(time - second_began_);
  rests_ = !second_touched_ || (explained && (rests_ || fell));
  if (rests_) {
    level_ = mean;
    level_time_ = time;
    least_ = std::min(least_, mean);
  }
  second_mean_ = mean;
  second_sum_ = second_count_ = 0.0;
  second_touched_ = false;
  second_began_ = time;
  if (++seconds_ % kRestSeconds != 0 || std::isinf(least_)) return;
  if (!std::exchange(rest_known_, true)) {
    rest_.first_mN = least_;
    rest_.first = time;
  }
  rest_.last_mN = least_;
  rest_.last = time;
  least_ = std::numeric_limits<double>::infinity();
}

}  // namespace merkel
