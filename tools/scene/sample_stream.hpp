#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/encoding/simulation_step.hpp"
#include "core/encoding/stimulation_encoder.hpp"
#include "core/expected.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/tick_record.hpp"
#include "core/scene/tactile_model.hpp"
#include "realtime/input/probe_input.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// Simulates samples as they are pushed, on the caller's thread. The spikes are bit-identical to
/// those of a Pipeline that replays the same samples, whenever and in whatever portions they come.
///
/// A tick is simulated when every probe has a sample beyond its end. The first tick starts at the
/// earliest of the probes' first samples.
class SampleStream {
 public:
  /// \param channels  ProbeSample::Channel bits of each probe's samples, one per indenter
  /// Builds the model. Real-time: no.
  [[nodiscard]] static Expected<SampleStream, SetupError> create(
      Scene scene, const std::vector<std::uint32_t>& channels);

  /// Takes a sample and simulates all due ticks. Fails, and ignores the sample, if it is not later
  /// than the probe's last one, is beyond the scene's limits, or is thousands of samples ahead of
  /// the other probes. \return the new spikes in order of time, valid until the next call.
  /// Real-time: no; may allocate if there are many spikes.
  [[nodiscard]] Expected<std::span<const SpikeEvent>, SetupError> push(std::size_t probe,
                                                                       const ProbeSample& sample);
  /// The stimulation commands of the last call of push() or finish(), in order of time, valid until
  /// the next; none if the scene has no electrodes. The last update of finish() is off.
  [[nodiscard]] std::span<const StimulationCommand> commands() const noexcept { return commands_; }
  /// Sets the drive of an electrode whose encoder is `own`, and of its group, from the next tick on
  /// and for the watchdog: 0 (off) to 1 (strongest). Fails if there is no such electrode.
  [[nodiscard]] Expected<void, SetupError> set_drive(const std::string& electrode, double amplitude,
                                                     double frequency);
  /// Drives that wait for the next tick, for a stream that replaces this one.
  [[nodiscard]] const std::vector<GivenDrive>& drives() const noexcept { return drives_; }
  void take_drives(std::vector<GivenDrive> drives) noexcept { drives_ = std::move(drives); }
  /// Null if the scene has no electrodes.
  [[nodiscard]] const StimulationEncoder* encoder() const noexcept { return encoder_.get(); }
  /// Sets a function that is called every few milliseconds of simulation. If it returns true,
  /// push() and finish() return early; the next call goes on, and also returns what the interrupted
  /// one had simulated.
  void set_interrupt(std::function<bool()> interrupt) { interrupt_ = std::move(interrupt); }
  /// Ends the stream: simulates up to the last sample. No sample may follow.
  [[nodiscard]] std::span<const SpikeEvent> finish();

  /// The end of the last tick, in probe time; empty before the first tick.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> time() const noexcept;
  [[nodiscard]] const TactileModel& model() const noexcept { return *model_; }
  [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
  [[nodiscard]] std::uint64_t ticks() const noexcept { return ticks_; }

 private:
  struct Line;
  SampleStream(Scene scene, Simulation simulation);
  [[nodiscard]] std::string fault_of(std::size_t probe, const ProbeSample& sample) const;
  [[nodiscard]] bool ready();
  [[nodiscard]] bool exhausted() const;
  /// Forgets what the last call returned, unless it was interrupted.
  void begin_call();
  /// Whether a tick is due and no one interrupts.
  [[nodiscard]] bool may_go_on();
  void simulate();

  Scene scene_;
  std::unique_ptr<TactileModel> model_;
  std::unique_ptr<StimulationEncoder> encoder_;
  std::unique_ptr<SpinningTeam> team_;
  std::unique_ptr<SimulationStep> step_;
  std::vector<std::unique_ptr<Line>> lines_;  ///< one per indenter
  std::vector<TickRecord> records_;
  std::optional<std::chrono::nanoseconds> next_;  ///< start of the next tick
  std::vector<GivenDrive> drives_;                ///< from the next tick on
  std::uint64_t ticks_ = 0;
  std::vector<SpikeEvent> spikes_;
  std::vector<StimulationCommand> commands_;
  std::function<bool()> interrupt_;
  bool interrupted_ = false;

 public:
  SampleStream(SampleStream&&) noexcept;
  SampleStream& operator=(SampleStream&&) noexcept;
  ~SampleStream();
};

}  // namespace merkel
