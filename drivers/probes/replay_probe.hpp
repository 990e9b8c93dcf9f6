#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/files/trace_file.hpp"
#include "drivers/probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Plays a trace file: `replay:FILE?chunk=N&use=all|depth|force`. If the trace has depth and force,
/// `use` can select one. `chunk` is the largest number of samples per read (default 256); the
/// spikes do not depend on it. The loop sets the pace: the probe reads ahead of the clock and waits
/// while its queue is full, so no sample is ever late.
class ReplayProbe final : public Probe {
 public:
  /// Reads the header and the first samples, so that an invalid file fails here.
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(const Uri& uri);

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return info_; }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override { return error_message_; }

 private:
  ReplayProbe(TraceReader reader, std::vector<ProbeSample> first, ProbeInfo info,
              std::size_t chunk);

  TraceReader reader_;
  std::vector<ProbeSample> first_;  ///< read at opening, not yet returned
  std::size_t next_of_first_ = 0;
  ProbeInfo info_;
  std::size_t chunk_;
  void take_over(std::span<ProbeSample> samples) const noexcept;
  std::uint32_t left_out_ = 0;                         ///< channels
  std::optional<std::chrono::nanoseconds> valid_for_;  ///< if the trace has no valid_for_s
  std::string error_message_;
};

}  // namespace merkel
