#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/tick_record.hpp"
#include "core/scene/tactile_model.hpp"
#include "realtime/loop/press_watch.hpp"

namespace merkel {

/// What a run has added up by neuron, patch and probe; read it after the run. Real-time: follow().
/// Thread: simulation.
class RunTally {
 public:
  explicit RunTally(const TactileModel& model)
      : presses_(model.indenters()),
        spikes_of_neuron_(model.neurons()),
        contact_spikes_of_neuron_(model.neurons()),
        contact_ticks_of_patch_(model.parameters().patches.size()),
        touched_(model.parameters().patches.size()) {}

  /// Adds a tick, after the model's step. \param records  one per probe
  void follow(std::span<const TickRecord> records, std::span<const SpikeEvent> spikes,
              const TactileModel& model) noexcept MERKEL_REALTIME {
    std::fill(touched_.begin(), touched_.end(), false);
    for (std::size_t i = 0; i < presses_.size(); ++i) {
      const ContactState& deepest = model.deepest()[i].contact;
      const bool array = model.parameters().indenters[i].taxels() != nullptr;
      const auto end = records[i].time;
      presses_[i].observe(records[i].contact, touches(records[i]),
                          array ? deepest.force_mN : deepest.depth_mm,
                          end - model.parameters().tick, end);
      if (touches(records[i])) touched_[model.parameters().indenters[i].patch] = true;
    }
    for (const SpikeEvent& spike : spikes) {
      ++spikes_of_neuron_[spike.neuron - 1];
      if (touched_[spike.patch]) ++contact_spikes_of_neuron_[spike.neuron - 1];
    }
    for (std::size_t i = 0; i < contact_ticks_of_patch_.size(); ++i) {
      if (touched_[i]) ++contact_ticks_of_patch_[i];
    }
  }

  [[nodiscard]] std::span<const std::uint64_t> spikes_of_neuron() const noexcept {
    return spikes_of_neuron_;
  }
  /// The same, only for ticks in which a probe touched the neuron's patch.
  [[nodiscard]] std::span<const std::uint64_t> contact_spikes_of_neuron() const noexcept {
    return contact_spikes_of_neuron_;
  }
  /// Number of these ticks, by patch.
  [[nodiscard]] std::span<const std::uint64_t> contact_ticks_of_patch() const noexcept {
    return contact_ticks_of_patch_;
  }
  /// The presses of each probe.
  [[nodiscard]] std::span<const PressWatch> presses() const noexcept { return presses_; }

 private:
  std::vector<PressWatch> presses_;
  std::vector<std::uint64_t> spikes_of_neuron_;
  std::vector<std::uint64_t> contact_spikes_of_neuron_;
  std::vector<std::uint64_t> contact_ticks_of_patch_;
  std::vector<bool> touched_;  ///< patches in this tick
};

}  // namespace merkel
