#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/probes/forwarding_probe.hpp"
#include "drivers/probes/sample_meter.hpp"

namespace merkel {

/// A device whose samples are timed as they are read (SampleMeter): the loop takes its buffer from
/// timing(), and each sample carries the period for which it stays valid if no other sample
/// follows.
class MeasuredProbe final : public ForwardingProbe {
 public:
  explicit MeasuredProbe(std::unique_ptr<Probe> probe) : ForwardingProbe(std::move(probe)) {}

  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] ProbeStatus status() const override;

 private:
  void publish(bool first);

  SampleMeter meter_;
  mutable std::mutex mutex_;  ///< guards timing_
  std::optional<SampleTiming> timing_;
};

}  // namespace merkel
