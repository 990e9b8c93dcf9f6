#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/probe.hpp"

namespace merkel {

/// Plays a recording or a simulated press like a device: each sample appears at its time on the
/// host's clock, and is lost if it is not read in time. The first sample is taken at the first
/// read.
class LiveProbe final : public Probe {
 public:
  explicit LiveProbe(std::unique_ptr<Probe> recording);

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return info_; }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override { return recording_->error_message(); }

 private:
  std::unique_ptr<Probe> recording_;
  ProbeInfo info_;
  std::vector<ProbeSample> ahead_;                 ///< read, but not yet due
  std::size_t next_ = 0;                           ///< next sample of `ahead_`
  std::optional<std::chrono::nanoseconds> shift_;  ///< host time − the recording's time
};

}  // namespace merkel
