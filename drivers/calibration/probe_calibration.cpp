#include "drivers/calibration/probe_calibration.hpp"

#include <cmath>

#include "core/units.hpp"
#include "drivers/protocols/unit_factors.hpp"
#include "drivers/sample_channels.hpp"

namespace merkel {

std::string ChannelCalibration::stem() const {
  if (is_named(source)) return name.substr(0, name.rfind('_'));
  return std::string(kDeviceChannelNames[static_cast<std::size_t>(source)]);
}

ProbeCalibration ProbeCalibration::natural(std::uint32_t device_channels) {
  const auto has = [&](DeviceChannel channel) { return (device_channels & bit_of(channel)) != 0U; };
  ProbeCalibration natural;
  if (has(DeviceChannel::kZ)) natural.channels[0] = {.source = DeviceChannel::kZ, .gain = -1.0};
  if (has(DeviceChannel::kForceZ)) natural.channels[1] = {.source = DeviceChannel::kForceZ};
  for (std::size_t i = 0; i < kPressChannels.size(); ++i) {
    if (has(kPressChannels[i])) natural.channels[i] = {.source = kPressChannels[i]};
  }
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
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i]) kProbeChannels[i].set(sample, channels[i]->apply(reading));
  }
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

bool ChannelCalibration::is_outside(double press, bool either_sign) const noexcept {
  if (!range) return false;
  constexpr double kShare = 0.02;
  constexpr double kNoises = 5.0;
  const auto [least, most] = *range;
  const double tolerance = kShare * (most - least) + kNoises * noise;
  const auto beyond = [tolerance](double value, double from, double to) {
    const double highest = to > 0.0 ? to : -from;  // points of the other sign cover as much
    return value > highest + tolerance || (value > 0.0 && value < from - tolerance);
  };
  return beyond(press, least, most) || (either_sign && beyond(-press, -most, -least));
}

bool ProbeCalibration::is_outside(const ProbeSample& sample) const noexcept {
  return (channels[0] && channels[0]->is_outside(sample.depth_mm, false)) ||
         (channels[1] && channels[1]->is_outside(units::N_from_mN(sample.force_mN), true));
}

std::uint32_t ProbeCalibration::channels_of_file() const {
  UnitFactors known;
  for (const auto& [key, factor] : factors) static_cast<void>(known.add(key, factor));
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (!channels[i]) continue;
    const std::string stem = channels[i]->stem();
    const bool has_factor = known.of(stem, {.quantity = Quantity::kVoltage}) ||
                            known.of(stem, {.quantity = Quantity::kCount});
    if (channels[i]->from_file || has_factor) bits |= 1U << i;
  }
  return bits;
}

}  // namespace merkel
