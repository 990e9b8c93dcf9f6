#include "realtime/input/contact_decision.hpp"

#include <algorithm>

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
  const bool has_zero = sample.touch == Touch::kFree || sample.touch == Touch::kTouching;
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
  follow_drift(sample);
}

void ContactDecision::follow_drift(const ProbeSample& sample) noexcept {
  const bool uncertain = (sample.doubts() & ProbeSample::kZeroUncertain) != 0U;
  if (any_ && uncertain) drift_.uncertain += sample.time - previous_;
  previous_ = sample.time;
  drift_.followed = drift_.followed || sample.zero_mN != 0.0;
  if (!drift_.followed) {
    follow_rest(sample);
  } else {
    drift_.last_mN = sample.zero_mN;
    drift_.last = sample.time;
  }
  if (any_) return;
  any_ = true;
  drift_.first_mN = sample.zero_mN;
  drift_.first = second_began_ = sample.time;
}

void ContactDecision::follow_rest(const ProbeSample& sample) noexcept {
  if (sample.time - second_began_ >= kSecond && second_count_ > 0.0) {
    least_ = std::min(least_, second_sum_ / second_count_);
    second_sum_ = second_count_ = 0.0;
    second_began_ = sample.time;
    if (++seconds_ % kRestSeconds == 0) {
      if (seconds_ == kRestSeconds) drift_.first_mN = least_;
      drift_.last_mN = least_;
      drift_.last = sample.time;
      least_ = std::numeric_limits<double>::infinity();
    }
  }
  second_sum_ += sample.force_mN;
  second_count_ += 1.0;
}

}  // namespace merkel
