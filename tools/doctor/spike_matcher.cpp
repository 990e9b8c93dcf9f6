#include "tools/doctor/spike_matcher.hpp"

namespace merkel {

void SpikeMatcher::match() {
  while (!arrivals_.empty()) {
    const SpikeArrival& arrived = arrivals_.front();
    while (!timings_.empty() && timings_.front().end < arrived.spike) timings_.pop_front();
    if (timings_.empty()) return;
    const TickTiming& timing = timings_.front();
    if (timing.end - tick_ > arrived.spike) {
      ++unmatched_;
    } else {
      sink_.record(arrived.arrival - timing.published);
      software_.record(arrived.arrival - timing.due);
      sample_to_received_.record(arrived.arrival - timing.arrival);
    }
    arrivals_.pop_front();
  }
}

}  // namespace merkel
