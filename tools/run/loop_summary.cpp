#include "tools/run/loop_summary.hpp"

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/json_text.hpp"

namespace merkel {
namespace {

std::string_view name_of(LoopWait wait) { return wait == LoopWait::kHybrid ? "hybrid" : "sleep"; }

std::string recently(const LatencySummary& latency) {
  if (latency.count == 0) return {};
  return fmt::format("; in the last seconds p50 {:.1f}, p99 {:.1f} µs", units::us_from(latency.p50),
                     units::us_from(latency.p99));
}

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
  if (latency.count == 0) return "not measured";
  return fmt::format("p50 {:.1f}, p99 {:.1f}, p99.9 {:.1f}, max {:.1f} µs",
                     units::us_from(latency.p50), units::us_from(latency.p99),
                     units::us_from(latency.p999), units::us_from(latency.longest));
}

std::string loop_text(const RunReport& report) {
  if (!report.host_time) return {};
  const HostTimeReport& host = *report.host_time;
  std::string text;
  if (host.sample_to_spike.count > 0) {
    text += "from a sample's arrival to its spike: " + latency_text(host.sample_to_spike) +
            recently(host.recent_sample_to_spike) + "\n";
  }
  if (host.sample_to_command.count > 0) {
    text += "from a sample's arrival to its commands: " + latency_text(host.sample_to_command) +
            recently(host.recent_sample_to_command) + "\n";
  }
  text += "loop: ";
  text.append(name_of(host.wait)).append(" wait");
  if (host.wait == LoopWait::kHybrid) {
    text += fmt::format(" (margin {:.0f} µs)", units::us_from(host.margin));
  }
  text += host.rights.fifo ? ", SCHED_FIFO " + std::to_string(host.rights.priority)
                           : std::string(", SCHED_OTHER");
  if (report.demotions > 0) text += ", demoted to SCHED_OTHER";
  if (host.rights.cpu) text += ", on core " + std::to_string(*host.rights.cpu);
  text += host.rights.memory_locked ? ", memory locked" : ", memory not locked";
  text += fmt::format("; {} page faults, {} involuntary context switches\n",
                      host.usage.minor_faults + host.usage.major_faults,
                      host.usage.involuntary_switches);
  if (host.queue.count > 0) {
    text += "  a sample's way to the host: " + latency_text(host.way) + "\n";
    text += "  a sample's time to the end of its tick: " + latency_text(host.tick_end) + "\n";
    text += "  delay: " + latency_text(host.delay) + "\n";
    text += "  queue (jitter buffer): " + latency_text(host.queue) + "\n";
  }
  text += "  wake-up: " + latency_text(host.wake_up) + "\n";
  text += "  tick: " + latency_text(host.tick) + "\n";
  text += "  publish: " + latency_text(host.publish) + "\n";
  return text;
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
      {"publish", latency_json(host.publish)}};
}

}  // namespace merkel
