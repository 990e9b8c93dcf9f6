#include "drivers/probe.hpp"

namespace merkel {

Expected<std::size_t, ProbeError> Probe::read(std::span<ProbeSample> samples,
                                              std::chrono::milliseconds patience) {
  Readings some = readings(samples.size());
  if (auto count = read(some, patience); !count) return count;
  std::size_t count = 0;
  for (std::size_t i = 0; i < some.size(); ++i) {
    if (const auto sample = some.sample(i)) samples[count++] = *sample;
  }
  return count;
}

}  // namespace merkel
