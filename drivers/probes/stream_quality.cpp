#include "drivers/probes/stream_quality.hpp"

namespace merkel {

double StreamQuality::bad_share() const noexcept {
  const std::uint64_t frames = good_ + bad_;
  return frames == 0 ? 0.0 : static_cast<double>(bad_) / static_cast<double>(frames);
}

bool StreamQuality::add(std::uint64_t good, std::uint64_t bad, Time now) {
  const Time window = parameters_.window;
  if (good + bad > 0) {
    if (slices_.empty() || now - slices_.back().begin >= window / kSlices) {
      slices_.push_back({.begin = now});
    }
    slices_.back().good += good;
    slices_.back().bad += bad;
    good_ += good;
    bad_ += bad;
  }
  while (slices_.size() > 1 && now - slices_.front().begin > window &&
         good_ + bad_ - slices_.front().good - slices_.front().bad >= kMinFrames) {
    good_ -= slices_.front().good;
    bad_ -= slices_.front().bad;
    slices_.pop_front();
  }
  if (trusted_) {
    if (bad_ == 0 || good_ + bad_ < kMinToJudge || bad_share() < parameters_.share) return false;
    trusted_ = false;
    distrusted_since_ = now;
    return true;
  }
  if (bad > 0 && good == 0) return false;
  if (now - distrusted_since_ < window || bad_share() >= parameters_.share / 2.0) return false;
  trusted_ = true;
  return true;
}

}  // namespace merkel
