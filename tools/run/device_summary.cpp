#include "tools/run/device_summary.hpp"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "core/units.hpp"

namespace merkel {

std::string device_text(const DeviceCounts& device) {
  std::string text = fmt::format(
      "  device: {} readings ({:.1f} per s, up to {} at once), {} lost, {} damaged, {} refused, {} "
      "duplicate, {} saturated; {} reboots, {} outages of {:.3f} s{}\n",
      device.readings, device.rate_Hz, device.largest_batch, device.lost, device.damaged,
      device.refused, device.duplicates, device.saturated, device.reboots, device.outages,
      units::s_from(device.outage), device.port.empty() ? "" : "; " + device.port);
  if (device.device_clock) {
    text += fmt::format(
        "  its clock: {:+.1f} ppm, mapped with {:.1f} µs of jitter; frames arrive {:.0f} µs late\n",
        device.drift_ppm, device.jitter_us, device.latency_us);
  }
  if (device.clock_mistrusted) {
    text += fmt::format(
        "  its clock runs at {:.4g} times the rate of this machine's: samples are timed by their "
        "arrival\n",
        device.clock_rate);
  }
  if (device.clock_outliers + device.clock_anchors > 0) {
    text += fmt::format("  its clock: {} impossible times replaced by arrival times, {} jumps\n",
                        device.clock_outliers, device.clock_anchors);
  }
  if (device.uncertainty_us) {
    text += fmt::format("  sample times are accurate to {:.0f} µs\n", *device.uncertainty_us);
  }
  return text;
}

nlohmann::json device_json(const std::optional<DeviceCounts>& device) {
  if (!device) return {};
  return {{"port", device->port},
          {"readings", device->readings},
          {"rate_hz", device->rate_Hz},
          {"largest_batch", device->largest_batch},
          {"lost", device->lost},
          {"damaged", device->damaged},
          {"refused", device->refused},
          {"duplicates", device->duplicates},
          {"saturated", device->saturated},
          {"reboots", device->reboots},
          {"outages", device->outages},
          {"outage_s", units::s_from(device->outage)},
          {"device_clock", device->device_clock},
          {"drift_ppm", device->drift_ppm},
          {"jitter_us", device->jitter_us},
          {"latency_us", device->latency_us},
          {"clock_outliers", device->clock_outliers},
          {"clock_anchors", device->clock_anchors},
          {"clock_rate", device->clock_rate},
          {"clock_mistrusted", device->clock_mistrusted},
          {"uncertainty_us",
           device->uncertainty_us ? nlohmann::json(*device->uncertainty_us) : nlohmann::json()}};
}

}  // namespace merkel
