#pragma once

#include <functional>

namespace merkel {

/// The duration of a piece of work, s: the median of several runs, each repeated until it takes
/// long enough for the clock. The first run, with cold caches, does not count. The clock is the
/// processor time of the calling thread: other programs do not change it. The caller of a worker
/// team spins while it waits, so the wait counts.
struct Measurement {
  double median_s = 0.0;
  double least_s = 0.0;
};
[[nodiscard]] Measurement measure(const std::function<void()>& work, int runs = 7,
                                  double run_s = 0.02);

}  // namespace merkel
