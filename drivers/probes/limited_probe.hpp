#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/probes/forwarding_probe.hpp"

namespace merkel {

/// The strongest press that a probe may report. Beyond it, the cause is a wrong unit or a crash of
/// the stage, not a touch.
struct PressLimits {
  double force_N = 50.0;
  double depth_mm = 15.0;
};

/// The reason to refuse a sample of the named probe; empty if within the limits.
[[nodiscard]] std::string press_excess(const ProbeSample& sample, const PressLimits& limits,
                                       const std::string& name);

/// Keeps presses beyond the limits from the model. A recording ends with an error at such a
/// reading; of a device, the probe has no value in it, which is counted as refused and reported.
class LimitedProbe final : public ForwardingProbe {
 public:
  /// \param limits  one for each of the probe's outputs; the default for others
  LimitedProbe(std::unique_ptr<Probe> probe, std::vector<PressLimits> limits)
      : ForwardingProbe(std::move(probe)), limits_(std::move(limits)) {
    limits_.resize(outputs().size());
    reported_.resize(outputs().size());
  }

  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override {
    return error_message_.empty() ? ForwardingProbe::error_message() : error_message_;
  }
  [[nodiscard]] ProbeStatus status() const override;

 private:
  std::vector<PressLimits> limits_;
  std::string error_message_;
  std::vector<bool> reported_;  ///< by output
  mutable std::mutex mutex_;    ///< guards refused_
  std::uint64_t refused_ = 0;
};

}  // namespace merkel
