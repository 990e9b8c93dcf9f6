#include "drivers/calibration/probe_calibration.hpp"

#include <cmath>

#include "core/units.hpp"

namespace merkel {

ProbeCalibration ProbeCalibration::natural(std::uint32_t device_channels) {
  const auto has = [&](DeviceChannel channel) { return (device_channels & bit_of(channel)) != 0U; };
  ProbeCalibration natural;
  if (has(DeviceChannel::kDepth)) {
    natural.channels[0] = {.source = DeviceChannel::kDepth};
  } else if (has(DeviceChannel::kZ)) {
    natural.channels[0] = {.source = DeviceChannel::kZ, .gain = -1.0};
  }
  if (has(DeviceChannel::kForce)) {
    natural.channels[1] = {.source = DeviceChannel::kForce};
  } else if (has(DeviceChannel::kForceZ)) {
    natural.channels[1] = {.source = DeviceChannel::kForceZ};
  }
  if (has(DeviceChannel::kX)) natural.channels[2] = {.source = DeviceChannel::kX};
  if (has(DeviceChannel::kY)) natural.channels[3] = {.source = DeviceChannel::kY};
  return natural;
}

void ProbeCalibration::complete(std::uint32_t device_channels) {
  const ProbeCalibration meaning = natural(device_channels);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (!channels[i]) channels[i] = meaning.channels[i];
  }
}

std::uint32_t ProbeCalibration::sample_channels() const noexcept {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i]) bits |= 1U << i;
  }
  return bits;
}

ProbeSample ProbeCalibration::apply(const DeviceReading& reading) const noexcept {
  ProbeSample sample{.channels = sample_channels()};
  if (channels[0]) sample.depth_mm = channels[0]->apply(reading);
  if (channels[1]) sample.force_mN = units::mN_from_N(channels[1]->apply(reading));
  if (channels[2]) sample.x_mm = channels[2]->apply(reading);
  if (channels[3]) sample.y_mm = channels[3]->apply(reading);
  return sample;
}

bool ProbeCalibration::saturated(const DeviceReading& reading) const noexcept {
  for (const auto& channel : channels) {
    if (channel && channel->saturation &&
        std::fabs(reading[channel->source]) >= *channel->saturation) {
      return true;
    }
  }
  return false;
}

}  // namespace merkel
