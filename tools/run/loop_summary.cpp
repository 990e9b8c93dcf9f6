#include "tools/run/loop_summary.hpp"

#include "core/units.hpp"
#include "tools/filled_text.hpp"

namespace merkel {
namespace {

std::string_view name_of(LoopWait wait) { return wait == LoopWait::kHybrid ? "hybrid" : "sleep"; }

}  // namespace

Json latency_json(const LatencySummary& latency) {
  if (latency.count == 0) return {};
  return {{"count", latency.count},
          {"p50_us", units::us_from(latency.p50)},
          {"p99_us", units::us_from(latency.p99)},
          {"p99.9_us", units::us_from(latency.p999)},
          {"max_us", units::us_from(latency.longest)}};
}

std::string latency_text(const LatencySummary& latency) {
  const std::string line = filled_text("latency", latency_json(latency));
  return line.substr(0, line.size() - 1);
}

Json loop_json(const RunReport& report) {
  if (!report.host_time) return {};
  const HostTimeReport& host = *report.host_time;
  return {
      {"sample_to_spike", latency_json(host.sample_to_spike)},
      {"sample_to_command", latency_json(host.sample_to_command)},
      {"recent_sample_to_spike", latency_json(host.recent_sample_to_spike)},
      {"recent_sample_to_command", latency_json(host.recent_sample_to_command)},
      {"wait", name_of(host.wait)},
      {"margin_us", host.wait == LoopWait::kHybrid ? Json(units::us_from(host.margin)) : Json()},
      {"scheduler", host.rights.fifo ? "fifo" : "normal"},
      {"priority", host.rights.fifo ? Json(host.rights.priority) : Json()},
      {"demoted", report.demotions > 0},
      {"cpu", host.rights.cpu ? Json(*host.rights.cpu) : Json()},
      {"memory_locked", host.rights.memory_locked},
      {"cpu_awake", host.rights.cpu_awake},
      {"missing_rights", host.rights.missing},
      {"page_faults", host.usage.minor_faults + host.usage.major_faults},
      {"minor_faults", host.usage.minor_faults},
      {"major_faults", host.usage.major_faults},
      {"involuntary_switches", host.usage.involuntary_switches},
      {"voluntary_switches", host.usage.voluntary_switches},
      {"way", latency_json(host.way)},
      {"tick_end", latency_json(host.tick_end)},
      {"delay", latency_json(host.delay)},
      {"wake_up", latency_json(host.wake_up)},
      {"queue", latency_json(host.queue)},
      {"tick", latency_json(host.tick)},
      {"processor", latency_json(host.processor)},
      {"publish", latency_json(host.publish)}};
}

}  // namespace merkel
