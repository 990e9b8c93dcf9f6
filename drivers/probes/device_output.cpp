#include "drivers/probes/device_output.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/printed.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

constexpr double kPressed_N = 0.2;
constexpr double kPressed_mm = 0.5;

}  // namespace

DeviceOutput::Result DeviceOutput::take_taxels(const DeviceReading& reading,
                                               const ProbeColumns& columns, std::span<double> row) {
  Result result;
  const std::span<double> kPa = columns.taxels_in(row);
  result.waiting = !taxels_->take(reading, kPa, result.notices);
  if (result.waiting) return result;
  result.zeros = taxels_->changed_zeros();
  result.absent = taxels_->out() == taxels_->size();
  if (result.absent) return result;
  ProbeSample sample{.force_mN = taxels_->force_mN(kPa), .channels = ProbeSample::kForce};
  if (taxels_->uncertain(kPa)) sample.set_doubts(ProbeSample::kZeroUncertain);
  columns.put(sample, row);
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
  ProbeSample sample = calibration_.apply(reading);
  const bool lacks = !plausible(sample);
  if (lacks != lacks_value_ && (gone_ || !reading.named.empty())) {
    result.notices.push_back(info_.name +
                             (lacks ? " has no value, or an impossible one: it is released until "
                                      "it has one; check its sensor"
                                    : " has values again"));
  }
  lacks_value_ = lacks;
  result.absent = !std::isfinite(sample.depth_mm + sample.force_mN + sample.x_mm + sample.y_mm);
  if (result.absent && lack_.empty()) lack_ = "its channel had no value";
  if (lacks) return result;
  gone_ = false;
  if (std::exchange(tared_, false)) sample.touch = Touch::kTared;
  result.outside = calibration_.is_outside(sample);
  if (result.outside) sample.set_doubts(sample.doubts() | ProbeSample::kOutsideCalibration);
  columns.put(sample, row);
  const std::span<double> further = columns.further_in(row);
  for (std::size_t i = 0; i < further_.size(); ++i) further[i] = reading[further_[i]];
  result.measured = true;
  result.saturated = reading.saturated || calibration_.saturated(reading);
  watch_.take(result.saturated, result.outside, reading.arrival, info_, result.notices);
  return result;
}

std::optional<std::string> DeviceOutput::take_channels(std::span<const ChannelName> channels) {
  std::string gone;
  for (std::size_t i = 0; i < calibration_.channels.size(); ++i) {
    const auto& channel = calibration_.channels[i];
    if (!channel) continue;
    const bool named = std::any_of(channels.begin(), channels.end(), [&](const ChannelName& each) {
      return each.channel == channel->source;
    });
    if (named) continue;
    gone +=
        (gone.empty() ? "" : ", ") + (channel->name.empty() ? std::string(kProbeChannels[i].name)
                                                            : printable_text(channel->name));
  }
  if (gone.empty()) return std::nullopt;
  lacks_value_ = gone_ = true;
  lack_ = "its device no longer names " + gone;
  return info_.name + " is released: " + lack_ + "; it has " + listed_channels(channels);
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
  tared_ = true;
  // A large change may be a press, which a tare would take away from every later reading.
  const bool pressed = std::fabs(shift) > (force ? kPressed_N : kPressed_mm);
  const char* const unit = force ? "N" : "mm";
  return info_.name + printed(" is tared: its zero is %.4f %s, where it read %+.4f %s%s", *zero,
                              unit, shift, unit,
                              pressed ? ": if the probe was pressed, lift it and tare again" : "");
}

}  // namespace merkel
