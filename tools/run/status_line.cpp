#include "tools/run/status_line.hpp"

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/run/counter_text.hpp"

namespace merkel {
namespace {

LiveReading reading_of(const RunProgress::ProbeProgress& probe) {
  LiveReading reading;
  if ((probe.channels & ProbeSample::kForce) != 0U) {
    reading.force_N = units::N_from_mN(probe.force_mN);
  }
  if ((probe.channels & ProbeSample::kDepth) != 0U) reading.depth_mm = probe.depth_mm;
  return reading;
}

}  // namespace

std::vector<std::string> StatusLine::fields(const RunProgress& now) {
  const RunProgress before = before_.value_or(RunProgress{});
  before_ = now;
  const double seconds = units::s_from(now.wall - before.wall);
  const auto rate = [seconds](std::uint64_t later, std::uint64_t earlier) {
    return seconds > 0.0 ? static_cast<double>(later - earlier) / seconds : 0.0;
  };
  std::vector<std::string> fields = {fmt::format("{:.0f} s", units::s_from(now.wall))};
  // As fast as possible, or behind.
  if (now.simulated > now.wall + std::chrono::seconds{5}) {
    fields.push_back(fmt::format("simulated {:.0f} s", units::s_from(now.simulated)));
  }
  if (!now.probes.empty()) {
    const RunProgress::ProbeProgress& probe = now.probes.front();
    fields.push_back(bar_.text(reading_of(probe)));
    fields.emplace_back(name_of(probe.state));
  }
  std::string faults = fault_text(now.counters);
  faults.erase(0, faults.find_first_not_of(' '));
  fields.push_back(std::move(faults));
  fields.push_back(
      fmt::format("{:.0f} spikes/s", rate(now.counters.spikes, before.counters.spikes)));
  fields.push_back(
      fmt::format("{:.0f} samples/s", rate(now.counters.samples, before.counters.samples)));
  fields.push_back(fmt::format("tick p99 {:.0f} us",
                               units::us_from(now.tick.since(before.tick).quantile(0.99))));
  return fields;
}

}  // namespace merkel
