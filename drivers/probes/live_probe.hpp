#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/probes/forwarding_probe.hpp"

namespace merkel {

/// Plays a recording or a simulated press like a device: every sample arrives when the host's
/// clock reaches its time, whether or not it is read in time. The first sample is due at
/// the first read.
class LiveProbe final : public ForwardingProbe {
 public:
  explicit LiveProbe(std::unique_ptr<Probe> recording);

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;

 private:
  ProbeInfo info_;
  Readings ahead_;                                 ///< read, but not yet due
  std::size_t next_ = 0;                           ///< next one of `ahead_`
  std::optional<std::chrono::nanoseconds> shift_;  ///< host time − the recording's time
};

}  // namespace merkel
