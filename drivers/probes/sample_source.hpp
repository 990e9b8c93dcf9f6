#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/probe.hpp"

namespace merkel {

/// The samples of a recording, in strictly increasing time: from a file or from a program's
/// memory.
class SampleSource {
 public:
  SampleSource() = default;
  SampleSource(const SampleSource&) = delete;
  SampleSource& operator=(const SampleSource&) = delete;
  virtual ~SampleSource() = default;

  /// ProbeSample::Channel bits of every sample.
  [[nodiscard]] virtual std::uint32_t channels() const noexcept = 0;
  /// Whether the samples read so far set ProbeSample::valid_for. If not, it is derived from their
  /// rate.
  [[nodiscard]] virtual bool has_validity() const noexcept { return false; }
  /// The run in which they were recorded, if known.
  [[nodiscard]] virtual std::optional<RecordedRun> run() const { return std::nullopt; }
  /// Names of ProbeSample::extra, in order.
  /// The number of taxels, if it was recorded from a tactile array.
  [[nodiscard]] virtual std::size_t taxels() const noexcept { return 0; }
  /// Their pressures in a sample, kPa; valid for the last 8192 samples.
  [[nodiscard]] virtual std::span<const float> taxels_of(const ProbeSample& /*sample*/) const {
    return {};
  }
  [[nodiscard]] virtual std::vector<std::string> extra_columns() const { return {}; }
  /// Sentences for the user since the last call.
  [[nodiscard]] virtual std::vector<std::string> take_notices() { return {}; }

  /// Reads up to samples.size() samples; 0 is the end. Fails with a sentence.
  [[nodiscard]] virtual Expected<std::size_t, SetupError> read(std::span<ProbeSample> samples) = 0;
};

}  // namespace merkel
