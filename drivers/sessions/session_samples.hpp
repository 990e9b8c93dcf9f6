#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sample_source.hpp"
#include "drivers/sessions/session_reader.hpp"

namespace merkel {

/// A fact of a session: the number of a probe that is a tactile array, a colon, and its taxels.
inline constexpr std::string_view kTaxelFact = "probe_taxels";

/// The samples of one probe in a recorded session, with the run in which they were recorded: the
/// same press, for any scene. Of a tactile array, what the loop used at each tick. Memory is
/// bounded.
class SessionSamples final : public SampleSource {
 public:
  /// \param probe  from 0. Fails if the session has no samples of this probe.
  [[nodiscard]] static Expected<std::unique_ptr<SampleSource>, SetupError> open(
      const std::string& path, std::uint32_t probe);
  /// True if a file starts like a session; false if it cannot be read.
  [[nodiscard]] static bool is_session(const std::string& path);

  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] ProbeColumns columns() const override {
    return {.further = session_.extra_columns().size(), .taxels = taxels_};
  }
  [[nodiscard]] std::optional<RecordedRun> run() const override { return run_; }
  [[nodiscard]] std::vector<std::string> extra_columns() const override {
    return session_.extra_columns();
  }
  [[nodiscard]] Expected<std::size_t, SetupError> read(Readings& readings,
                                                       std::size_t most) override;

 private:
  SessionSamples(SessionReader session, std::uint32_t probe, const RecordedRun& run)
      : session_(std::move(session)), probe_(probe), run_(run) {}
  Expected<bool, SetupError> refill();
  void take_taxels(const TickRecord& tick);

  SessionReader session_;
  std::uint32_t probe_;
  RecordedRun run_;
  std::uint32_t channels_ = 0;
  SessionChunk chunk_;
  Readings waiting_{ReadingColumns()};
  std::size_t next_ = 0;
  std::vector<SyncEdge> edges_;    ///< of the probe, not handed on
  std::vector<TaxelZeros> zeros_;  ///< the same
  bool found_ = false;             ///< a sample, whose channels are those of all
  std::optional<std::chrono::nanoseconds> last_;
  // Of a tactile array:
  std::size_t taxels_ = 0;
  std::deque<TaxelBlock> blocks_;
  std::vector<double> pressures_;  ///< of the last tick
  std::uint32_t next_row_ = 0;
};

}  // namespace merkel
