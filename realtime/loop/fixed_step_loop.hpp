#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/simulation_step.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/taxel_blocks.hpp"
#include "core/records/tick_record.hpp"
#include "core/scene/tactile_model.hpp"
#include "realtime/clocks/clock.hpp"
#include "realtime/input/drive_input.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/loop/delay_control.hpp"
#include "realtime/loop/loop_statistics.hpp"
#include "realtime/loop/run_tally.hpp"
#include "realtime/loop/tick_timing.hpp"
#include "realtime/output/fanout.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/threads/stall_watch.hpp"

namespace merkel {

/// The work of the simulation thread: one tick after the other, at fixed steps of probe time.
///
/// Tick k ends at T_k = start + k·tick in probe time and is due at wall time T_k + wall_offset +
/// delay. The delay is a jitter buffer: the samples around T_k arrive within it. A tick reads the
/// contacts at its end, steps the model from T_{k-1} to T_k and publishes the spikes. When a sink
/// that takes commands fails, or its queue is full, all electrodes are switched off at the next
/// tick and stay off.
///
/// This class alone decides what happens when the loop falls behind. Up to `max_catch_up_ticks`
/// due ticks run back to back. Beyond that, all due ticks are skipped, counted and recorded as a
/// gap event, and the loop continues at the next point of the same grid. The membranes keep their
/// state across a gap. A loop that catches up rests for a ninth of the time, so that other threads
/// of its core go on.
template <Clock C>
class FixedStepLoop {
 public:
  struct Parameters {
    std::chrono::nanoseconds start{0};        ///< probe time at which the first tick begins
    std::chrono::nanoseconds wall_offset{0};  ///< wall time − probe time
    std::chrono::nanoseconds delay{0};        ///< jitter buffer
    DelayControl* delay_control = nullptr;    ///< changes the delay during the run; borrowed
    StallWatch* stalls = nullptr;             ///< of the cores, not charged to devices; borrowed
    /// Set if the first samples waited while their rate was measured. All ticks are then caught up,
    /// and none counts as an overrun, until the first tick that is on time.
    bool starts_behind = false;
    /// Since when the start of the run has occupied this machine, on the host's clock: samples that
    /// waited for it are not charged to their devices.
    std::chrono::nanoseconds starting_since{0};
    std::optional<std::chrono::nanoseconds>
        duration;  ///< how much to simulate; default: everything
    std::int64_t max_catch_up_ticks = 20;
    StimulationEncoder* encoder = nullptr;  ///< null: no electrodes; borrowed
    DriveInput* drives = nullptr;           ///< of encoders of the user's own; borrowed
    bool without_gate = false;  ///< receivers get commands that are never valid: a virtual clock
    BoundedQueue<TickTiming>* timings = nullptr;  ///< receives one item per tick with spikes
  };

  /// \param inputs  one per indenter of the model
  FixedStepLoop(const Parameters& parameters, C& clock, TactileModel& model,
                std::span<ProbeInput> inputs, Fanout& fanout, LoopStatistics& statistics,
                BoundedQueue<LoopEvent>& events)
      : parameters_(parameters),
        clock_(clock),
        model_(model),
        inputs_(inputs),
        fanout_(fanout),
        statistics_(statistics),
        events_(events),
        step_(model, parameters.encoder),
        taxel_blocks_(blocks_of(inputs)),
        records_(inputs.size()),
        released_since_(inputs.size()),
        uncertain_since_(inputs.size()),
        tally_(model) {}

  /// Runs until the probes' streams end, the duration is over, or `stop` is set.
  /// Real-time: yes. Thread: simulation.
  void run(const std::atomic<bool>& stop) noexcept MERKEL_REALTIME {
    const auto tick = model_.parameters().tick;
    const std::int64_t last_tick = parameters_.duration ? *parameters_.duration / tick : INT64_MAX;
    rested_ = now_ = clock_.now();
    bool behind_at_start = parameters_.starts_behind;
    for (std::int64_t k = 1; k <= last_tick && !stop.load(std::memory_order_relaxed); ++k) {
      if (exhausted()) break;
      const auto due =
          parameters_.start + k * tick + parameters_.wall_offset + delay(tick, behind_at_start);
      const auto started = wait_for(due, tick, stop);
      if (started < due) break;  // stopped
      const std::int64_t behind = std::max<std::int64_t>(0, (started - due) / tick);
      behind_at_start = behind_at_start && !waited_ && k < kMaxTicksBehind;
      statistics_.behind_at_start_ns.store(behind_at_start ? (started - due).count() : 0,
                                           std::memory_order_relaxed);
      if (behind_at_start) DelayControl::add_stall(inputs_, parameters_.starting_since, now_);
      if (behind > parameters_.max_catch_up_ticks && !behind_at_start) {
        const std::int64_t ticks = std::min(behind, last_tick - k + 1);
        skip_ticks(k, ticks, tick);
        k += ticks - 1;
        continue;
      }
      on_time_ = !behind_at_start;
      if (behind > 0 && on_time_) statistics_.catch_up_ticks.add();
      simulate(k, due, started, tick);
      if (on_time_) classify_overrun(due, tick);
    }
    publish(step_.finish());
    fanout_.end();
  }

  [[nodiscard]] const RunTally& tally() const noexcept { return tally_; }

 private:
  static constexpr std::int64_t kMaxTicksBehind = 20'000;
  /// A loop that is behind works for at most this long, or one tick, then rests for a part of it.
  static constexpr std::chrono::nanoseconds kMaxWithoutRest{20'000'000};
  static constexpr int kRestShare = 8;

  /// The delay of the next tick.
  [[nodiscard]] std::chrono::nanoseconds delay(std::chrono::nanoseconds tick,
                                               bool catches_up) noexcept {
    if (parameters_.delay_control != nullptr) {
      parameters_.delay = parameters_.delay_control->step(inputs_, tick, catches_up);
    }
    return parameters_.delay;
  }
  [[nodiscard]] bool exhausted() const noexcept {
    return std::all_of(inputs_.begin(), inputs_.end(),
                       [](const ProbeInput& input) { return input.exhausted(); });
  }

  /// Waits until a tick is due, and checks `stop` once per tick.
  /// \return when the tick begins, or a time before it is due if stopped
  std::chrono::nanoseconds wait_for(std::chrono::nanoseconds due, std::chrono::nanoseconds tick,
                                    const std::atomic<bool>& stop) noexcept {
    while (due - now_ > 2 * tick && !stop.load(std::memory_order_relaxed)) {
      clock_.wait_until(now_ + tick);
      now_ = clock_.now();
    }
    if (due - now_ > 2 * tick) return now_;
    waited_ = now_ < due;
    const auto worked = now_ - rested_;
    const bool rests = waited_ || worked >= kMaxWithoutRest;
    clock_.wait_until(waited_ || !rests ? due : now_ + worked / kRestShare);
    now_ = clock_.now();
    if (rests) rested_ = now_;
    if (waited_) {
      statistics_.wake_up.record(now_ - due);
      if (now_ - due > DelayControl::kStall) DelayControl::add_stall(inputs_, due, now_);
    }
    StallWatch::Stall stall;
    while (parameters_.stalls != nullptr && parameters_.stalls->take(stall)) {
      DelayControl::add_stall(inputs_, stall.begin, stall.end);
    }
    return now_;
  }

  /// Counts an overrun and its cause: the model, if the tick alone took a processor for longer than
  /// it lasts, or for longer than the host delayed and stopped it. An overrun caused by the
  /// previous one inherits its cause.
  void classify_overrun(std::chrono::nanoseconds due, std::chrono::nanoseconds tick) noexcept {
    const auto overrun = now_ - (due + tick);
    if (overrun.count() <= 0) {
      overran_ = false;
      return;
    }
    if (computed_for_ > tick) {
      by_host_ = false;
    } else if (!overran_) {
      by_host_ = now_ - due - computed_for_ > computed_for_;
    }
    overran_ = true;
    statistics_.overruns.add();
    (by_host_ ? statistics_.overruns_by_late_wake_up : statistics_.overruns_by_long_compute).add();
    statistics_.longest_overrun_ns.raise_to(static_cast<std::uint64_t>(overrun.count()));
  }

  void skip_ticks(std::int64_t k, std::int64_t ticks, std::chrono::nanoseconds tick) noexcept {
    statistics_.gaps.add();
    statistics_.skipped_ticks.add(static_cast<std::uint64_t>(ticks));
    raise({.time = parameters_.start + (k - 1) * tick,
           .length = ticks * tick,
           .subject = 0,
           .kind = LoopEvent::Kind::kGap});
  }

  void simulate(std::int64_t k, std::chrono::nanoseconds due, std::chrono::nanoseconds started,
                std::chrono::nanoseconds tick) noexcept {
    TickTiming timing{.end = parameters_.start + k * tick, .due = due, .started = started};
    const auto used_before = clock_.processor_time();
    read_probes(timing);
    if (fanout_.commands_failed() && step_.encoder() != nullptr) {
      step_.encoder()->fail_safe(StimulationCommand::Stop::kSinkFailure);
    }
    take_drives(timing);
    const SimulationStep::Output made = step_.step(records_);
    timing.computed = clock_.now();
    publish(made, timing);
    computed_for_ = clock_.processor_time() - used_before;
    count(made, timing);
  }

  void take_drives(const TickTiming& timing) noexcept {
    if (step_.encoder() == nullptr || parameters_.drives == nullptr) return;
    const auto oldest = timing.started - step_.encoder()->parameters().stimulation.watchdog;
    parameters_.drives->take(timing.end, oldest, [this](const GivenDrive& drive) {
      step_.encoder()->set_drive(drive);
      fanout_.publish(std::span(&drive, 1), clock_);
    });
  }

  /// Reads the contacts at the end of a tick into its records.
  void read_probes(const TickTiming& timing) noexcept {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const std::uint64_t late_before = inputs_[i].counts().late;
      while (!inputs_[i].ready_for(timing.end) && clock_.wait_for_others()) {
      }
      const auto last_sample = inputs_[i].last_time();
      const ProbeInput::Reading reading = inputs_[i].at(timing.end);
      records_[i] = {.time = timing.end,
                     .delay = parameters_.delay,
                     .contact = reading.contact,
                     .number = statistics_.ticks.value() + 1,
                     .probe = static_cast<std::uint32_t>(i),
                     .late = static_cast<std::uint16_t>(
                         std::min<std::uint64_t>(inputs_[i].counts().late - late_before, 0xFFFF)),
                     .state = reading.state,
                     .doubts = reading.doubts,
                     .touch = reading.touch};
      // During an outage, `arrival` is that of the last sample before it, so it is not recorded.
      const auto arrival = inputs_[i].last_arrival();
      if (arrival && on_time_ && reading.state == ProbeInput::State::kFollowing) {
        statistics_.queue.record(timing.started - *arrival);
        statistics_.way.record(*arrival - *inputs_[i].last_time());
        statistics_.tick_end.record(timing.end - *inputs_[i].last_time());
      }
      follow_release(i, reading.state, timing.end, last_sample);
      follow_zero(i, reading.doubts, timing.end);
      if (!inputs_[i].taxels().empty()) model_.set_taxels(i, inputs_[i].taxels());
    }
  }

  /// Publishes a tick: its spikes, then its commands, then its inputs.
  void publish(const SimulationStep::Output& made, TickTiming& timing) noexcept {
    fanout_.publish(made.spikes, clock_);
    publish(made.commands);
    fanout_.publish_watched(model_, timing.end, clock_);
    for (TickRecord& record : records_) publish_taxels(record);
    timing.published = now_ = clock_.now();
    for (TickRecord& record : records_) {
      record.latency = on_time_ ? timing.published - timing.due : std::chrono::nanoseconds{0};
      record.press = model_.presses()[record.probe];
    }
    fanout_.publish(std::span<const TickRecord>(records_), clock_);
    fanout_.published(timing.published, timing.published - timing.due);
    for (const SpikeEvent& reset : model_.resets()) {
      raise({.time = reset.time,
             .length = std::chrono::nanoseconds{0},
             .subject = reset.neuron,
             .kind = LoopEvent::Kind::kNeuronReset});
    }
  }

  void publish(std::span<const StimulationCommand> commands) noexcept {
    if (step_.encoder() == nullptr) return;
    fanout_.publish(commands, clock_);
    for (const StimulationCommand& command : commands) {
      const SentCommand unsent{.command = command};
      if (parameters_.without_gate) fanout_.publish(std::span(&unsent, 1), clock_);
    }
    statistics_.commands.add(commands.size());
    statistics_.commands_limited.raise_to(step_.encoder()->clippings().all());
    statistics_.stimulation_stops.raise_to(step_.encoder()->stops());
    const StimulatorSteps::Counts& rounding = step_.encoder()->rounding();
    if (rounding.rounded == 0) return;
    statistics_.commands_rounded.raise_to(rounding.rounded);
    statistics_.largest_rounding_nA.raise_to(static_cast<std::uint64_t>(1e3 * rounding.largest_uA));
    statistics_.largest_rounding_mHz.raise_to(
        static_cast<std::uint64_t>(1e3 * rounding.largest_Hz));
  }

  /// Counts what a tick made and how long it took.
  void count(const SimulationStep::Output& made, TickTiming& timing) noexcept {
    tally_.follow(records_, made.spikes, model_);
    statistics_.spikes.add(made.spikes.size());
    statistics_.neuron_resets.add(model_.resets().size());
    statistics_.spikes_refused.raise_to(model_.spikes_refused());
    statistics_.tick.record(timing.computed - timing.started);
    statistics_.processor.record(computed_for_);
    statistics_.publish.record(timing.published - timing.computed);
    if (on_time_) count_latency(made, timing);
    statistics_.ticks.add();
  }

  void count_latency(const SimulationStep::Output& made, TickTiming& timing) noexcept {
    statistics_.delay.record(parameters_.delay);
    const auto arrival = inputs_.front().last_arrival();
    if (arrival && records_.front().state == ProbeInput::State::kFollowing) {
      const auto latency = timing.published - *arrival;
      if (!made.spikes.empty()) statistics_.sample_to_spike.record(latency);
      if (!made.commands.empty()) statistics_.sample_to_command.record(latency);
    }
    if (parameters_.timings == nullptr || made.spikes.empty()) return;
    timing.arrival = arrival.value_or(timing.started);
    if (!parameters_.timings->try_push(timing)) statistics_.timings_dropped.add();
  }

  /// One for each probe; empty for those that are no tactile array.
  static std::vector<ChangedTaxels<TaxelBlock>> blocks_of(std::span<ProbeInput> inputs) {
    std::vector<ChangedTaxels<TaxelBlock>> blocks;
    for (const ProbeInput& input : inputs) blocks.emplace_back(input.taxels().size());
    return blocks;
  }

  void publish_taxels(TickRecord& record) noexcept {
    const std::span<const float> taxels = inputs_[record.probe].taxels();
    if (taxels.empty()) return;
    const std::span<const TaxelBlock> changed =
        taxel_blocks_[record.probe].changed(taxels, record.time, record.number, record.probe);
    record.taxel_blocks = static_cast<std::uint16_t>(changed.size());
    fanout_.publish(changed, clock_);
  }

  /// Reports when a probe is released and when its samples return.
  void follow_release(std::size_t probe, ProbeInput::State state, std::chrono::nanoseconds time,
                      std::optional<std::chrono::nanoseconds> last_sample) noexcept {
    const bool released = state == ProbeInput::State::kReleased;
    auto& since = released_since_[probe];
    if (released == since.has_value()) return;
    if (released) {
      statistics_.releases.add();
      since = last_sample.value_or(time);
      raise({.time = time,
             .length = std::chrono::nanoseconds{0},
             .subject = static_cast<std::uint32_t>(probe),
             .kind = LoopEvent::Kind::kRelease});
      return;
    }
    if (state != ProbeInput::State::kEnded) {
      raise({.time = time,
             .length = time - *since,
             .subject = static_cast<std::uint32_t>(probe),
             .kind = LoopEvent::Kind::kResume});
    }
    since.reset();
  }

  /// Reports when the zero of a probe becomes uncertain, and when it is certain again.
  void follow_zero(std::size_t probe, std::uint8_t doubts, std::chrono::nanoseconds time) noexcept {
    const bool uncertain = (doubts & ProbeSample::kZeroUncertain) != 0U;
    auto& since = uncertain_since_[probe];
    if (uncertain == since.has_value()) return;
    raise({.time = time,
           .length = uncertain ? std::chrono::nanoseconds{0} : time - *since,
           .subject = static_cast<std::uint32_t>(probe),
           .kind = uncertain ? LoopEvent::Kind::kZeroUncertain : LoopEvent::Kind::kZeroCertain});
    since = uncertain ? std::optional(time) : std::nullopt;
  }

  void raise(const LoopEvent& event) noexcept {
    if (!events_.try_push(event)) statistics_.events_dropped.add();
    fanout_.publish(std::span<const LoopEvent>(&event, 1), clock_);
  }

  Parameters parameters_;
  C& clock_;
  TactileModel& model_;
  std::span<ProbeInput> inputs_;
  Fanout& fanout_;
  LoopStatistics& statistics_;
  BoundedQueue<LoopEvent>& events_;
  SimulationStep step_;
  std::vector<ChangedTaxels<TaxelBlock>> taxel_blocks_;
  std::vector<TickRecord> records_;
  std::vector<std::optional<std::chrono::nanoseconds>> released_since_;
  std::vector<std::optional<std::chrono::nanoseconds>> uncertain_since_;  ///< zeros
  RunTally tally_;
  std::chrono::nanoseconds now_{0};           ///< when the clock was last read
  std::chrono::nanoseconds rested_{0};        ///< when the loop last waited
  bool waited_ = false;                       ///< for the present tick to be due
  bool overran_ = false;                      ///< whether the previous tick overran
  bool on_time_ = true;                       ///< whether the backlog of the start is caught up
  bool by_host_ = false;                      ///< cause of the last overrun
  std::chrono::nanoseconds computed_for_{0};  ///< processor time of the last tick
};

}  // namespace merkel
