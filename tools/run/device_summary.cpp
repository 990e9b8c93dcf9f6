#include "tools/run/device_summary.hpp"

#include "core/units.hpp"

namespace merkel {

Json timing_json(const SampleTiming& timing) {
  return {{"rate_hz", 1e3 / units::ms_from(timing.period)},
          {"period_ms", units::ms_from(timing.period)},
          {"jitter_ms", units::ms_from(timing.jitter)},
          {"delay_ms", units::ms_from(timing.delay)}};
}

Json device_json(const std::optional<DeviceCounts>& device) {
  if (!device) return {};
  Json json = {{"port", device->port},
               {"rate_hz", device->rate_Hz},
               {"age_ms", device->age_ms},
               {"outage_s", units::s_from(std::chrono::nanoseconds{device->outage_ns})},
               {"device_clock", device->device_clock},
               {"clock_mapped",  // not the stamps of this machine, nor too few to know better
                device->device_clock && (device->drift_ppm != 0.0 || device->jitter_us != 0.0)},
               {"drift_ppm", device->drift_ppm},
               {"jitter_us", device->jitter_us},
               {"latency_us", device->latency_us},
               {"clock_rate", device->clock_rate},
               {"clock_mistrusted", device->clock_mistrusted},
               {"uncertainty_us", device->uncertainty_us ? Json(*device->uncertainty_us) : Json()}};
  for (const auto& field : kDeviceCounterFields<>) {
    const std::string_view name = field.name.substr(std::string_view("device_").size());
    json[std::string(name)] = (*device).*field.cell;
  }
  return json;
}

}  // namespace merkel
