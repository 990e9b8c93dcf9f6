#include "tools/run/device_summary.hpp"

#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "core/units.hpp"

namespace merkel {

std::string device_text(const DeviceCounts& device) {
  const auto number = [](std::uint64_t count) { return std::to_string(count); };
  const auto decimal = [](const char* format, double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return std::string(text.data());
  };
  std::string text =
      "  device: " + number(device.readings) + " readings (" + decimal("%.1f", device.rate_Hz) +
      " per s, up to " + number(device.largest_batch) + " at once), " + number(device.lost) +
      " lost, " + number(device.damaged) + " damaged, " + number(device.refused) + " refused, " +
      number(device.duplicates) + " duplicate, " + number(device.saturated) + " saturated; " +
      number(device.reboots) + " reboots, " + number(device.outages) + " outages of " +
      decimal("%.3f", units::s_from(device.outage)) + " s" +
      (device.port.empty() ? "" : "; " + device.port) + "\n";
  if (device.device_clock) {
    text += "  its clock: " + decimal("%+.1f", device.drift_ppm) + " ppm, mapped with " +
            decimal("%.1f", device.jitter_us) + " µs of jitter; frames arrive " +
            decimal("%.0f", device.latency_us) + " µs late\n";
  }
  if (device.clock_mistrusted) {
    text += "  its clock runs at " + decimal("%.4g", device.clock_rate) +
            " times the rate of this machine's: samples are timed by their arrival\n";
  }
  if (device.clock_outliers + device.clock_anchors > 0) {
    text += "  its clock: " + number(device.clock_outliers) +
            " impossible times replaced by arrival times, " + number(device.clock_anchors) +
            " jumps\n";
  }
  if (device.uncertainty_us) {
    text += "  sample times are accurate to " + decimal("%.0f", *device.uncertainty_us) + " us\n";
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
