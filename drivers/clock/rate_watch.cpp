#include "drivers/clock/rate_watch.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kBatchWindow{100};
constexpr double kLargestError = 0.03;
constexpr std::uint32_t kTrustedAfter = 50;  ///< windows
constexpr std::chrono::seconds kOften{2};

}  // namespace

void RateWatch::restart() noexcept {
  frames_ = 0;
  previous_.reset();
  count_ = anchor_count_ = 0;
  good_windows_ = 0;
  agrees_ = true;
  rate_ = 1.0;
}

void RateWatch::reanchored(Time arrival) noexcept {
  Time& oldest = anchors_[anchor_count_++ % anchors_.size()];
  const bool often = anchor_count_ > anchors_.size() && arrival - oldest < kOften;
  oldest = arrival;
  if (!often) return;
  agrees_ = false;
  good_windows_ = 0;
}

void RateWatch::observe(Time device_time, Time arrival) noexcept {
  if (frames_ > 0 && arrival - window_.front().arrival >= kBatchWindow) {
    const Frame early = early_frame();
    if (previous_) compare(early);
    previous_ = early;
    frames_ = 0;
  }
  if (frames_ < kFrames) window_[frames_++] = {.arrival = arrival, .device = device_time};
}

/// An early frame of the window; not the earliest one of many, because its time may be wrong.
RateWatch::Frame RateWatch::early_frame() noexcept {
  const auto begin = window_.begin();
  const auto chosen = begin + static_cast<std::ptrdiff_t>(frames_ / 8);
  std::nth_element(
      begin, chosen, begin + static_cast<std::ptrdiff_t>(frames_),
      [](const Frame& a, const Frame& b) { return a.arrival - a.device < b.arrival - b.device; });
  return *chosen;
}

void RateWatch::compare(const Frame& now) noexcept {
  const auto host = static_cast<double>((now.arrival - previous_->arrival).count());
  if (host <= 0.0) return;
  rates_[count_++ % kRates] = static_cast<double>((now.device - previous_->device).count()) / host;
  const std::size_t known = std::min(count_, kRates);
  std::array<double, kRates> sorted = rates_;
  std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(known));
  const double low = sorted[(known - 1) / 2];
  const double high = sorted[known / 2];
  const bool wrong = low > 1.0 + kLargestError || high < 1.0 - kLargestError;
  rate_ = (low + high) / 2.0;
  if (count_ < kRates) return;
  // To be trusted again, the clock must be right all the time, not only in the median.
  const bool right = !wrong && std::fabs(rates_[(count_ - 1) % kRates] - 1.0) < 0.5;
  good_windows_ = right ? good_windows_ + 1 : 0;
  if (wrong) agrees_ = false;
  if (!agrees_ && good_windows_ >= kTrustedAfter) {
    agrees_ = true;
    anchor_count_ = 0;
  }
}

}  // namespace merkel
