#pragma once

#include <functional>

namespace merkel {

/// How long a piece of work takes, s: the median of several runs, each repeated until it takes long
/// enough for the clock. The first run, which finds cold caches, does not count. The clock is the
/// calling thread's processor time: other programs cost it nothing, and a team's caller spins while
/// it waits for the others.
struct Measurement {
  double median_s = 0.0;
  double least_s = 0.0;
};
[[nodiscard]] Measurement measure(const std::function<void()>& work, int runs = 7,
                                  double run_s = 0.02);

}  // namespace merkel
