#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/files/trace_file.hpp"
#include "drivers/probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Plays a trace file: `replay:FILE?chunk=N&use=all|depth|force`. `use` leaves the other of the two
/// out, where the trace has both. `chunk` is the most samples it hands over at once
/// (default 256); the spikes do not depend on it. Pacing is the loop's business: the probe reads
/// ahead of the clock and waits while its queue is full, so that no sample is ever late.
class ReplayProbe final : public Probe {
 public:
  /// Reads the header and the first samples, so that a file that cannot be played fails here.
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(const Uri& uri);

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return info_; }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override { return error_message_; }

 private:
  ReplayProbe(TraceReader reader, std::vector<ProbeSample> first, ProbeInfo info,
              std::size_t chunk);

  TraceReader reader_;
  std::vector<ProbeSample> first_;  ///< read at opening, not yet handed over
  std::size_t next_of_first_ = 0;
  ProbeInfo info_;
  std::size_t chunk_;
  void take_over(std::span<ProbeSample> samples) const noexcept;
  std::uint32_t left_out_ = 0;                         ///< channels
  std::optional<std::chrono::nanoseconds> valid_for_;  ///< where the trace does not say
  std::string error_message_;
};

}  // namespace merkel
