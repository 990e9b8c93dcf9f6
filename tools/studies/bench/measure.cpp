#include "tools/studies/bench/measure.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/units.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {
namespace {

double seconds_of(const std::function<void()>& work, int repeats) {
  const auto begin = processor_time(::pthread_self());
  for (int i = 0; i < repeats; ++i) work();
  return units::s_from(processor_time(::pthread_self()) - begin) / repeats;
}

}  // namespace

Measurement measure(const std::function<void()>& work, int runs, double run_s) {
  const double first = seconds_of(work, 1);
  const double warm = std::max(1e-9, std::min(first, seconds_of(work, 1)));
  const int repeats = static_cast<int>(std::clamp(std::ceil(run_s / warm), 1.0, 1e7));
  std::vector<double> seconds;
  for (int run = 0; run < runs; ++run) seconds.push_back(seconds_of(work, repeats));
  std::sort(seconds.begin(), seconds.end());
  return {.median_s = seconds[seconds.size() / 2], .least_s = seconds.front()};
}

}  // namespace merkel
