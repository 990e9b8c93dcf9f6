#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/tick_record.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {

/// One tick of everything: the model and, if the scene has electrodes, the encoder. Live runs,
/// replays and streams of samples step it, so that the same records give the same bits.
/// Real-time: yes, after construction.
class SimulationStep {
 public:
  /// Valid until the next step.
  struct Output {
    std::span<const SpikeEvent> spikes;            ///< in order of time
    std::span<const StimulationCommand> commands;  ///< none without electrodes
  };

  /// \param encoder  null if the scene has no electrodes. Both are borrowed.
  SimulationStep(TactileModel& model, StimulationEncoder* encoder)
      : model_(model), encoder_(encoder), contacts_(model.indenters()) {}

  /// Advances by one tick, which ends at the records' time.
  /// \param records  one per probe, of the same time
  Output step(std::span<const TickRecord> records) noexcept MERKEL_REALTIME {
    bool held = false;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      contacts_[i] = records[i].contact;
      held = held || records[i].state == TickRecord::State::kHeld;
    }
    const std::span<SpikeEvent> spikes =
        model_.step(contacts_, records.front().time - model_.parameters().tick);
    if (held) {
      for (SpikeEvent& spike : spikes) spike.flags |= SpikeEvent::kInputHeld;
    }
    if (encoder_ == nullptr) return {.spikes = spikes, .commands = {}};
    return {.spikes = spikes,
            .commands = encoder_->step({.records = records,
                                        .presses = model_.presses(),
                                        .spikes = spikes,
                                        .resets = model_.resets()})};
  }

  /// The last update of a run: everything off.
  [[nodiscard]] std::span<const StimulationCommand> finish() noexcept MERKEL_REALTIME {
    return encoder_ != nullptr ? encoder_->finish() : std::span<const StimulationCommand>{};
  }

  [[nodiscard]] TactileModel& model() noexcept { return model_; }
  [[nodiscard]] StimulationEncoder* encoder() noexcept { return encoder_; }

 private:
  TactileModel& model_;
  StimulationEncoder* encoder_;
  std::vector<ContactInput> contacts_;
};

}  // namespace merkel
