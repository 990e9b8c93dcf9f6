#include "drivers/probes/measured_probe.hpp"

#include "core/printed.hpp"
#include "core/units.hpp"

namespace merkel {

Expected<std::size_t, ProbeError> MeasuredProbe::read(Readings& readings,
                                                      std::chrono::milliseconds patience) {
  auto count = ForwardingProbe::read(readings, patience);
  if (!count) {
    if (meter_.finish()) publish(true);
    return count;
  }
  // Until the first second is over, use the device's nominal period.
  const auto nominal =
      SampleMeter::stale_after(info().period.value_or(std::chrono::milliseconds{100}));
  for (ReadingHead& head : readings.heads()) {
    const bool first = !meter_.timing();
    if (meter_.add(head)) publish(first);
    head.valid_for = meter_.timing() ? meter_.timing()->stale_after : nominal;
  }
  return count;
}

void MeasuredProbe::publish(bool first) {
  const SampleTiming& now = *meter_.timing();
  const std::scoped_lock lock(mutex_);
  if (!first && std::chrono::abs(now.period - timing_->period) > timing_->period / 3) {
    add_notice(info().name +
               printed(": samples now arrive every %.3g ms with %.3g ms of jitter, no "
                       "longer every %.3g ms",
                       units::ms_from(now.period), units::ms_from(now.jitter),
                       units::ms_from(timing_->period)));
  }
  timing_ = now;
}

ProbeStatus MeasuredProbe::status() const {
  ProbeStatus status = ForwardingProbe::status();
  status.timed = true;
  const std::scoped_lock lock(mutex_);
  status.timing = timing_;
  return status;
}

}  // namespace merkel
