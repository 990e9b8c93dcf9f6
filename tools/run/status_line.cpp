#include "tools/run/status_line.hpp"

#include <array>
#include <cstdio>

#include "core/units.hpp"
#include "tools/run/counter_text.hpp"

namespace merkel {
std::string StatusLine::text(const RunProgress& now) {
  const RunProgress before = before_.value_or(RunProgress{});
  before_ = now;
  const double seconds = units::s_from(now.wall - before.wall);
  const auto rate = [seconds](std::uint64_t later, std::uint64_t earlier) {
    return seconds > 0.0 ? static_cast<double>(later - earlier) / seconds : 0.0;
  };
  const auto ticks = now.tick.since(before.tick);
  const auto wake_ups = now.wake_up.since(before.wake_up);
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(),
                "%.0f s  %.0f samples/s  tick p50 %.0f p99 %.0f max %.0f µs  wake-up p99 %.1f µs  "
                "%.0f spikes/s",
                units::s_from(now.wall), rate(now.counters.samples, before.counters.samples),
                units::us_from(ticks.quantile(0.5)), units::us_from(ticks.quantile(0.99)),
                units::us_from(ticks.longest()), units::us_from(wake_ups.quantile(0.99)),
                rate(now.counters.spikes, before.counters.spikes));
  return line.data() + fault_text(now.counters);
}

}  // namespace merkel
