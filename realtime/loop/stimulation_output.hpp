#pragma once

#include <span>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/realtime_tag.hpp"
#include "core/scene/tactile_model.hpp"
#include "realtime/clocks/clock.hpp"
#include "realtime/loop/loop_statistics.hpp"
#include "realtime/output/fanout.hpp"

namespace merkel {

/// The last stage of the loop: converts a tick of the model to stimulation commands in the queues
/// of the sinks. When a sink that takes commands fails, or its queue is full, all electrodes are
/// switched off at the next tick and stay off. Real-time: yes. Thread: simulation.
class StimulationOutput {
 public:
  /// \param encoder  null if the scene has no electrodes; borrowed
  StimulationOutput(StimulationEncoder* encoder, Fanout& fanout, LoopStatistics& statistics)
      : encoder_(encoder), fanout_(fanout), statistics_(statistics) {}

  /// Call after the model's step. \param records  of the tick, one per probe
  /// \return whether there were commands
  template <Clock C>
  bool step(std::span<const TickRecord> records, std::span<const SpikeEvent> spikes,
            const TactileModel& model, C& clock) noexcept MERKEL_REALTIME {
    if (encoder_ == nullptr) return false;
    if (fanout_.commands_failed()) encoder_->fail_safe(StimulationCommand::Stop::kSinkFailure);
    const auto commands = encoder_->step({.records = records,
                                          .presses = model.presses(),
                                          .spikes = spikes,
                                          .resets = model.resets()});
    publish(commands, clock);
    return !commands.empty();
  }

  /// The last update of the run: everything off.
  template <Clock C>
  void finish(C& clock) noexcept MERKEL_REALTIME {
    if (encoder_ != nullptr) publish(encoder_->finish(), clock);
  }

 private:
  template <Clock C>
  void publish(std::span<const StimulationCommand> commands, C& clock) noexcept {
    fanout_.publish(commands, clock);
    statistics_.commands.add(commands.size());
    statistics_.commands_limited.raise_to(encoder_->clippings().all());
    statistics_.stimulation_stops.raise_to(encoder_->stops());
  }

  StimulationEncoder* encoder_;
  Fanout& fanout_;
  LoopStatistics& statistics_;
};

}  // namespace merkel
