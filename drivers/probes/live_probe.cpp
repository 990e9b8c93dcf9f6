#include "drivers/probes/live_probe.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace merkel {
namespace {

constexpr std::size_t kAhead = 256;

std::chrono::nanoseconds now() noexcept {
  return std::chrono::steady_clock::now().time_since_epoch();
}

}  // namespace

LiveProbe::LiveProbe(std::unique_ptr<Probe> recording)
    : ForwardingProbe(std::move(recording)), info_(ForwardingProbe::info()) {
  info_.name += ", live";
  info_.replayed = false;
  ahead_.reserve(kAhead);
}

Expected<std::size_t, ProbeError> LiveProbe::read(std::span<ProbeSample> samples,
                                                  std::chrono::milliseconds patience) {
  if (next_ == ahead_.size()) {
    ahead_.resize(kAhead);
    const auto count = ForwardingProbe::read(ahead_, patience);
    ahead_.resize(count.value_or(0));
    next_ = 0;
    if (!count) return Unexpected<ProbeError>(count.error());
    if (*count == 0) return 0;
  }
  if (!shift_) shift_ = now() - ahead_.front().time;
  const auto first_taken = ahead_[next_].time + *shift_;
  const auto until = std::min(first_taken, now() + patience);
  std::this_thread::sleep_until(std::chrono::steady_clock::time_point(until));

  std::size_t count = 0;
  const auto arrival = now();
  while (count < samples.size() && next_ < ahead_.size() &&
         ahead_[next_].time + *shift_ <= arrival) {
    samples[count] = ahead_[next_++];
    samples[count].time += *shift_;
    samples[count++].arrival = arrival;
  }
  return count;
}

}  // namespace merkel
