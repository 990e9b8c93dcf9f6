#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probes/sample_source.hpp"
#include "drivers/sessions/session_reader.hpp"

namespace merkel {

/// The samples of one probe in a recorded session, with the run in which they were recorded: the
/// same press, for any scene. Memory is bounded.
class SessionSamples final : public SampleSource {
 public:
  /// \param probe  from 0. Fails if the session has no samples of this probe.
  [[nodiscard]] static Expected<std::unique_ptr<SampleSource>, SetupError> open(
      const std::string& path, std::uint32_t probe);
  /// True if a file starts like a session; false if it cannot be read.
  [[nodiscard]] static bool is_session(const std::string& path);

  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] bool has_validity() const noexcept override { return session_.has_validity(); }
  [[nodiscard]] std::optional<RecordedRun> run() const override { return run_; }
  [[nodiscard]] std::vector<std::string> extra_columns() const override {
    return session_.extra_columns();
  }
  [[nodiscard]] Expected<std::size_t, SetupError> read(std::span<ProbeSample> samples) override;

 private:
  SessionSamples(SessionReader session, std::uint32_t probe, const RecordedRun& run)
      : session_(std::move(session)), probe_(probe), run_(run) {}
  Expected<bool, SetupError> refill();

  SessionReader session_;
  std::uint32_t probe_;
  RecordedRun run_;
  std::uint32_t channels_ = 0;
  SessionChunk chunk_;
  std::vector<ProbeSample> waiting_;
  std::size_t next_ = 0;
  std::optional<std::chrono::nanoseconds> last_;
};

}  // namespace merkel
