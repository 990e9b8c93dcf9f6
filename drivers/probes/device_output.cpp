#include "drivers/probes/device_output.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

constexpr double kPressed_N = 0.2;
constexpr double kPressed_mm = 0.5;
constexpr std::chrono::milliseconds kSaturationPause{1000};

}  // namespace

DeviceOutput::Result DeviceOutput::take_taxels(const DeviceReading& reading,
                                               const ProbeColumns& columns, std::span<double> row) {
  Result result;
  const std::span<double> kPa = columns.taxels_in(row);
  result.waiting = !taxels_->take(reading, kPa, result.notices);
  if (result.waiting) return result;
  columns.put({.force_mN = taxels_->force_mN(kPa), .channels = ProbeSample::kForce}, row);
  result.measured = true;
  result.saturated = reading.saturated;
  return result;
}

DeviceOutput::Result DeviceOutput::take(const DeviceReading& reading, const ProbeColumns& columns,
                                        std::span<double> row) {
  if (taxels_) return take_taxels(reading, columns, row);
  Result result;
  if (tare_.pending()) {
    if (auto sentence = tare(reading)) result.notices.push_back(std::move(*sentence));
  }
  const ProbeSample sample = calibration_.apply(reading);
  const bool lacks = !plausible(sample);
  if (lacks != lacks_value_ && !reading.named.empty()) {
    result.notices.push_back(info_.name +
                             (lacks ? " has no value, or an impossible one: it is released until "
                                      "it has one; check its sensor"
                                    : " has values again"));
  }
  lacks_value_ = lacks;
  if (lacks) return result;
  columns.put(sample, row);
  const std::span<double> further = columns.further_in(row);
  for (std::size_t i = 0; i < further_.size(); ++i) further[i] = reading[further_[i]];
  result.measured = true;
  result.saturated = reading.saturated || calibration_.saturated(reading);
  // Reported at its start; at most once a second if it recurs.
  if (result.saturated && !saturated_ && reading.arrival >= saturation_again_) {
    result.notices.push_back(info_.name + ": the sensor is at the end of its range");
    saturation_again_ = reading.arrival + kSaturationPause;
  }
  saturated_ = result.saturated;
  return result;
}

/// Takes the mean of some readings as the new zero of force, or of depth without force.
std::optional<std::string> DeviceOutput::tare(const DeviceReading& reading) {
  const bool force = calibration_.channels[1].has_value();
  auto& channel = calibration_.channels[force ? 1 : 0];
  if (!channel) {
    tare_.cancel();
    return info_.name + " measures neither force nor depth: there is nothing to tare";
  }
  const auto zero = tare_.add(reading[channel->source]);
  if (!zero) return std::nullopt;
  const double shift = channel->gain * (*zero - channel->zero);
  if (!std::isfinite(shift)) {
    return info_.name + " was not tared: its readings are not finite";
  }
  channel->zero = *zero;
  // A large change may be a press, which a tare would take away from every later reading.
  const bool pressed = std::fabs(shift) > (force ? kPressed_N : kPressed_mm);
  const char* const unit = force ? "N" : "mm";
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                " is tared: its zero is %.4f %s, where it read %+.4f %s%s", *zero, unit, shift,
                unit, pressed ? ": if the probe was pressed, lift it and tare again" : "");
  return info_.name + text.data();
}

}  // namespace merkel
