#include "drivers/clock/rate_watch.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace merkel {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kWatchWindow{40};
constexpr double kLargestError = 0.03;
constexpr std::uint32_t kTrustedAfter = 125;  ///< windows
constexpr std::chrono::seconds kOften{2};
constexpr std::array<std::size_t, 5> kSpans = {5, 10, 20, 40, 80};  ///< windows
constexpr std::size_t kFewWindows = 5;  ///< of so few, the largest residual is the scatter
constexpr double kSigmas = 5.0;
constexpr double kSigmaOfMedian = 1.4826;  ///< of a normal distribution

double middle_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void RateWatch::reanchored(Time arrival) noexcept {
  // A single jump says nothing about the rate; a wrong rate makes the clock jump again.
  if (anchor_count_ == 0 || arrival - last_anchor_ > kOften) count_ = frames_ = 0;
  last_anchor_ = arrival;
  Time& oldest = anchors_[anchor_count_++ % anchors_.size()];
  const bool often = anchor_count_ > anchors_.size() && arrival - oldest < kOften;
  oldest = arrival;
  if (!often) return;
  agrees_ = false;
  good_windows_ = 0;
}

void RateWatch::observe(Time device_time, Time arrival) {
  if (frames_ > 0 && arrival - window_.front().arrival >= kWatchWindow) {
    compare(early_frame());
    frames_ = skipped_ = 0;
    stride_ = 1;
  }
  if (++skipped_ < stride_) return;
  skipped_ = 0;
  if (frames_ == kFrames) {  // keep every second one
    for (std::size_t i = 0; i < kFrames / 2; ++i) window_[i] = window_[2 * i];
    frames_ = kFrames / 2;
    stride_ *= 2;
  }
  window_[frames_++] = {.arrival = arrival, .device = device_time};
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

/// The slope through the newest frames.
RateWatch::Fit RateWatch::fit(std::size_t frames) const {
  std::array<Frame, kHistory> newest;
  for (std::size_t i = 0; i < frames; ++i) newest[i] = history_[(count_ - frames + i) % kHistory];
  const auto host_ns = [&](std::size_t i) {
    return static_cast<double>((newest[i].arrival - newest[0].arrival).count());
  };
  const auto device_ns = [&](std::size_t i) {
    return static_cast<double>((newest[i].device - newest[0].device).count());
  };
  std::vector<double> values;
  values.reserve(frames * (frames - 1) / 2);
  for (std::size_t i = 0; i < frames; ++i) {
    for (std::size_t j = i + 1; j < frames; ++j) {
      values.push_back((device_ns(j) - device_ns(i)) / std::max(host_ns(j) - host_ns(i), 1.0));
    }
  }
  const double slope = middle_of(values);
  values.clear();
  for (std::size_t i = 0; i < frames; ++i) values.push_back(device_ns(i) - slope * host_ns(i));
  const double centre = middle_of(values);
  for (double& value : values) value = std::fabs(value - centre);
  const double scatter_ns = frames <= kFewWindows ? *std::max_element(values.begin(), values.end())
                                                  : kSigmaOfMedian * middle_of(values);
  const double span_ns = std::max(host_ns(frames - 1), 1.0);
  return {.slope = slope,
          .error = kSigmas * scatter_ns * std::sqrt(12.0 / static_cast<double>(frames)) / span_ns};
}

void RateWatch::compare(const Frame& now) {
  history_[count_++ % kHistory] = now;
  if (count_ < kFewWindows) return;
  bool wrong = false;
  for (const std::size_t span : kSpans) {
    if (span > count_) break;
    const Fit fitted = fit(span);
    rate_ = fitted.slope;
    wrong = std::fabs(fitted.slope - 1.0) > kLargestError + fitted.error;
    if (wrong) break;
  }
  good_windows_ = wrong ? 0 : good_windows_ + 1;
  if (wrong) {
    agrees_ = false;
    count_ = 0;  // only what follows can show that the clock is right again
  } else if (!agrees_ && good_windows_ >= kTrustedAfter) {
    agrees_ = true;
    anchor_count_ = 0;
  }
}

}  // namespace merkel
