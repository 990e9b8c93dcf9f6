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
    : ForwardingProbe(std::move(recording)),
      info_(ForwardingProbe::outputs().front()),
      ahead_(columns_of(ForwardingProbe::outputs()), kAhead) {
  info_.name += ", live";
  info_.replayed = false;
}

Expected<std::size_t, ProbeError> LiveProbe::read(Readings& readings,
                                                  std::chrono::milliseconds patience) {
  readings.clear();
  if (next_ == ahead_.size()) {
    next_ = 0;
    const auto count = ForwardingProbe::read(ahead_, patience);
    if (!count) ahead_.clear();
    if (!count || *count == 0) {
      readings.take_beside(ahead_, shift_.value_or(std::chrono::nanoseconds{0}));
      return count;
    }
  }
  if (!shift_) shift_ = now() - ahead_.head(0).time;
  const auto first_taken = ahead_.head(next_).time + *shift_;
  const auto until = std::min(first_taken, now() + patience);
  std::this_thread::sleep_until(std::chrono::steady_clock::time_point(until));

  const auto arrival = now();
  const std::size_t first = next_;
  while (next_ - first < readings.room() && next_ < ahead_.size() &&
         ahead_.head(next_).time + *shift_ <= arrival) {
    ++next_;
  }
  readings.add(ahead_, first, next_ - first);
  readings.take_beside(ahead_, *shift_);
  for (ReadingHead& head : readings.heads()) {
    head.time += *shift_;
    head.arrival = arrival;
  }
  return readings.size();
}

}  // namespace merkel
