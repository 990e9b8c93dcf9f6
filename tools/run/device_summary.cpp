#include "tools/run/device_summary.hpp"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "tools/number_text.hpp"

namespace merkel {

std::string timing_text(const SampleTiming& timing) {
  const double rate_Hz = 1e3 / units::ms_from(timing.period);
  return fmt::format(
      "rate: {} samples/s with {} ms of jitter; loop delay in a run: {} ms\n",
      rate_Hz < 1e3 ? fmt::format("{:.4g}", rate_Hz) : fmt::format("{:.0f}", rate_Hz),
      number_text(units::ms_from(timing.jitter)), number_text(units::ms_from(timing.delay)));
}

std::string device_text(const DeviceCounts& device) {
  std::string text = fmt::format(
      "  device: {} ({:.1f} per s, up to {} at once), {} lost, {} damaged, {} refused, {} "
      "duplicate, {} saturated; {}, {} of {:.3f} s{}\n",
      counted(device.readings, "reading"), device.rate_Hz, device.largest_batch, device.lost,
      device.damaged, device.refused, device.duplicates, device.saturated,
      counted(device.reboots, "reboot"), counted(device.outages, "outage"),
      units::s_from(std::chrono::nanoseconds{device.outage_ns}),
      device.port.empty() ? "" : "; " + device.port);
  if (device.outside_calibration > 0) {
    text += fmt::format("  {} of its readings are outside the range of their calibration\n",
                        device.outside_calibration);
  }
  if (device.reordered > 0) {
    text += fmt::format("  {} frames older than the newest one dropped\n", device.reordered);
  }
  if (device.overruns > 0) {
    text += fmt::format("  its buffer was full {}: the readings lost are counted by their times\n",
                        counted(device.overruns, "time"));
  }
  if (device.distrusted > 0) {
    text += fmt::format(
        "  most of its data was damaged {} times: {} readings not used, the press released\n",
        device.distrusted, device.withheld);
  }
  const bool mapped = device.drift_ppm != 0.0 || device.jitter_us != 0.0;
  if (device.device_clock && !mapped) {  // the stamps of this machine, or too few to know better
    text += fmt::format("  its stamps are the times of its samples, which arrive {:.0f} µs later\n",
                        device.latency_us);
  } else if (device.device_clock) {
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
  nlohmann::json json = {
      {"port", device->port},
      {"rate_hz", device->rate_Hz},
      {"age_ms", device->age_ms},
      {"outage_s", units::s_from(std::chrono::nanoseconds{device->outage_ns})},
      {"device_clock", device->device_clock},
      {"drift_ppm", device->drift_ppm},
      {"jitter_us", device->jitter_us},
      {"latency_us", device->latency_us},
      {"clock_rate", device->clock_rate},
      {"clock_mistrusted", device->clock_mistrusted},
      {"uncertainty_us",
       device->uncertainty_us ? nlohmann::json(*device->uncertainty_us) : nlohmann::json()}};
  for (const auto& field : kDeviceCounterFields<>) {
    const std::string_view name = field.name.substr(std::string_view("device_").size());
    json[std::string(name)] = (*device).*field.cell;
  }
  return json;
}

}  // namespace merkel
