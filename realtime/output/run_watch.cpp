#include "realtime/output/run_watch.hpp"

#include <algorithm>

#include "realtime/threads/host_time.hpp"

namespace merkel {

using std::chrono::nanoseconds;

StimulationGate::Moment RunWatch::moment(std::span<nanoseconds> newest) const noexcept {
  for (std::size_t patch = 0; patch < newest.size(); ++patch) {
    newest[patch] = StimulationGate::kNone;
    for (const ProbeQueue* const device : devices_of_patch_[patch]) {
      const nanoseconds time{device->newest_ns.load(std::memory_order_relaxed)};
      newest[patch] = std::min(newest[patch], time);
    }
  }
  // The clock is read last: everything above is older.
  const nanoseconds last_tick = beat_.last_published();
  const StimulationSwitch::State by_hand = stimulation_.state();
  return {.now = host_now(),
          .wall_offset = nanoseconds{wall_offset_.load(std::memory_order_relaxed)},
          .delay = nanoseconds{delay_.load(std::memory_order_relaxed)},
          .last_tick = last_tick,
          .newest = newest,
          .stopped = by_hand.by != StimulationSwitch::By::kNone,
          .stops = by_hand.stops};
}

}  // namespace merkel
