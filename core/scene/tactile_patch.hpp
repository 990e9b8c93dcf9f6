#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/contact/placed_contact.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/receptor_drive.hpp"
#include "core/records/neuron_sample.hpp"
#include "core/records/spike_event.hpp"
#include "core/scene/afferents.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// The afferents of one patch of skin: receptors and neurons, stepped one tick at a time. An
/// untouched patch whose neurons are all at rest is not stepped. Real-time: yes, after
/// construction.
class TactilePatch {
 public:
  /// \param layout  has one site per neuron of `afferents`
  /// \param drive  its output is the input of the afferents
  /// \param most_spikes  largest number of spikes per tick
  TactilePatch(const PatchLayout& layout, const ReceptorDrive::Parameters& drive,
               Afferents afferents, std::size_t most_spikes)
      : sites_(layout.afferents),
        drive_(layout.receptors, sites_.size(), drive),
        afferents_(std::move(afferents)),
        drive_begin_(afferents_.neurons().size()),
        spikes_(most_spikes) {}

  /// Resets to rest, without contact.
  void reset() noexcept MERKEL_REALTIME;

  /// Advances by `steps` steps of the neurons from `start`. The contacts apply at the end; the
  /// input of the afferents runs linearly from the previous call's to the new one.
  void step(std::span<const PlacedContact> contacts, int steps, std::chrono::nanoseconds start,
            WorkerTeam* team) noexcept MERKEL_REALTIME;

  /// The spikes of the last step, in order of time.
  [[nodiscard]] const SpikeBuffer& spikes() const noexcept { return spikes_; }
  /// Neurons reset in the last step because of a non-finite state.
  [[nodiscard]] std::span<const SpikeEvent> resets() const noexcept;

  [[nodiscard]] std::size_t neurons() const noexcept { return drive_begin_.size(); }
  /// The positions of the afferents; afferent n, from 1 within the patch, is sites()[n−1].
  [[nodiscard]] std::span<const AfferentSite> sites() const noexcept { return sites_; }
  [[nodiscard]] const ReceptorDrive& drive() const noexcept { return drive_; }
  /// Drive and potential of a neuron, counted from 0, at the end of the last step, in the units of
  /// NeuronSample. Real-time: yes.
  [[nodiscard]] NeuronSample neuron(std::size_t neuron) const noexcept MERKEL_REALTIME;
  /// Number of neurons stepped in the last step, in whole blocks; the others were at rest.
  [[nodiscard]] std::size_t active_neurons() const noexcept;
  /// Whether the last step found nothing to do.
  [[nodiscard]] bool asleep() const noexcept { return asleep_; }

 private:
  std::vector<AfferentSite> sites_;
  ReceptorDrive drive_;
  Afferents afferents_;
  std::vector<double> drive_begin_;
  SpikeBuffer spikes_;
  bool asleep_ = false;
};

}  // namespace merkel
