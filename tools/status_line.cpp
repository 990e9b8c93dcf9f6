#include "tools/status_line.hpp"

#include <array>
#include <cstdio>

#include "core/units.hpp"

namespace merkel {
namespace {

using Count = unsigned long long;

}  // namespace

std::string StatusLine::text(const RunProgress& now) {
  const RunProgress before = before_.value_or(RunProgress{});
  before_ = now;
  const double seconds = units::s_from(now.wall - before.wall);
  const auto rate = [seconds](std::uint64_t later, std::uint64_t earlier) {
    return seconds > 0.0 ? static_cast<double>(later - earlier) / seconds : 0.0;
  };
  const auto ticks = now.tick.since(before.tick);
  const auto wake_ups = now.wake_up.since(before.wake_up);
  std::array<char, 320> line{};
  std::snprintf(
      line.data(), line.size(),
      "%.0f s  %.0f samples/s  %llu late  tick p50 %.0f p99 %.0f max %.0f µs  wake-up p99 "
      "%.1f µs  %llu overruns  %llu skipped  %.0f spikes/s  %llu dropped",
      units::s_from(now.wall), rate(now.samples, before.samples),
      static_cast<Count>(now.samples_late), units::us_from(ticks.quantile(0.5)),
      units::us_from(ticks.quantile(0.99)), units::us_from(ticks.longest()),
      units::us_from(wake_ups.quantile(0.99)), static_cast<Count>(now.overruns),
      static_cast<Count>(now.skipped_ticks), rate(now.spikes, before.spikes),
      static_cast<Count>(now.samples_dropped) + static_cast<Count>(now.spikes_dropped));
  return line.data();
}

}  // namespace merkel
