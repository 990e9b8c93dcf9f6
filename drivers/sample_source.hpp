#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/readings.hpp"
#include "drivers/probe.hpp"

namespace merkel {

/// The samples of a recording, in strictly increasing time: from a file or from a program's
/// memory.
class SampleSource {
 public:
  /// ReadingHead::valid_for of a sample whose recording states none: it is derived from their rate.
  static constexpr std::chrono::nanoseconds kNotStated{-1};

  SampleSource() = default;
  SampleSource(const SampleSource&) = delete;
  SampleSource& operator=(const SampleSource&) = delete;
  virtual ~SampleSource() = default;

  /// ProbeSample::Channel bits of every sample.
  [[nodiscard]] virtual std::uint32_t channels() const noexcept = 0;
  /// The columns of its rows.
  [[nodiscard]] virtual ProbeColumns columns() const { return {}; }
  /// The run in which they were recorded, if known.
  [[nodiscard]] virtual std::optional<RecordedRun> run() const { return std::nullopt; }
  /// Names of their further columns, in order.
  [[nodiscard]] virtual std::vector<std::string> extra_columns() const { return {}; }
  /// Sentences for the user since the last call.
  [[nodiscard]] virtual std::vector<std::string> take_notices() { return {}; }

  /// Adds up to `most` samples, with columns(); 0 is the end. Fails with a sentence; the samples
  /// before the fault are added.
  [[nodiscard]] virtual Expected<std::size_t, SetupError> read(Readings& readings,
                                                               std::size_t most) = 0;

 protected:
  SampleSource(SampleSource&&) = default;
};

}  // namespace merkel
