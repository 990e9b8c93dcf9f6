#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/sample_source.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// The options of replay: URIs, for --help.
inline constexpr const char* kReplayProbeHelp =
    "Recordings, replay:FILE?option=value&...: use (all; depth or force), probe (0), live (0), "
    "repeat (1; 0: without end)";

/// Plays a recording: `replay:FILE?chunk=N&use=all|depth|force&probe=N`, a trace or a session.
/// `use` selects depth or force if the recording has both; `probe` is the number of a probe in a
/// session, from 0. A session plays on the ticks of the run that recorded it. `chunk` is the
/// largest number of samples per read (default 256); the spikes do not depend on it. Pacing is the
/// loop's responsibility: the probe reads ahead of the clock and waits while its queue is full, so
/// that no sample is ever late.
class ReplayProbe final : public Probe {
 public:
  /// Reads the header and the first samples, so that an invalid file fails here.
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(const Uri& uri);

  struct Playback {
    std::string uri;
    std::string name;         ///< for display
    std::uint32_t use = ~0U;  ///< ProbeSample::Channel bits to keep
    std::size_t chunk = 256;  ///< most samples handed over at once
  };
  /// Plays the samples of any source.
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> play(
      std::unique_ptr<SampleSource> source, const Playback& playback);

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override { return error_message_; }
  [[nodiscard]] std::vector<std::string> take_notices() override;

 private:
  ReplayProbe(std::unique_ptr<SampleSource> source, Readings first, ProbeInfo info,
              std::size_t chunk);
  void take_over(Readings& readings, std::size_t from);
  [[nodiscard]] std::string gap_in(std::span<const ReadingHead> heads);

  std::unique_ptr<SampleSource> source_;
  Readings first_;  ///< read at opening, not yet handed over
  std::size_t next_of_first_ = 0;
  ProbeInfo info_;
  std::size_t chunk_;
  std::chrono::nanoseconds valid_for_{0};  ///< of samples whose recording states none
  std::string error_message_;
  std::optional<std::chrono::nanoseconds> last_time_;
  bool gap_noted_ = false;
  std::mutex mutex_;  ///< guards the rest
  std::vector<std::string> notices_;
};

}  // namespace merkel
