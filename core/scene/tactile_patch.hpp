#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "core/contact/placed_contact.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley_population.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/receptor_drive.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/records/spike_event.hpp"
#include "core/scene/energy_driven_neurons.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// The afferents of one patch of skin: receptors and neurons, a tick at a time. A patch that
/// nothing has touched since all its neurons came to rest costs next to nothing. Real-time: yes,
/// after construction.
class TactilePatch {
 public:
  /// \param most_spikes  that a tick can make
  TactilePatch(std::span<const Receptor> receptors, std::size_t neurons,
               const ReceptorDrive::Parameters& drive,
               const HodgkinHuxleyPopulation::Parameters& population,
               const std::optional<LatticeCoupling>& network, std::size_t most_spikes);
  /// The same with neurons that the mean energy density drives.
  /// \param drive  whose output is the mean energy density
  TactilePatch(std::span<const Receptor> receptors, std::size_t neurons,
               const ReceptorDrive::Parameters& drive,
               const EnergyDrivenNeurons::Parameters& energy_driven, std::size_t most_spikes);

  /// Back to rest, without contact.
  void reset() noexcept MERKEL_REALTIME;

  /// Advances by `steps` membrane steps from `start`. The contacts are those at the end; the
  /// currents run linearly from the previous call's to theirs.
  void step(std::span<const PlacedContact> contacts, int steps, std::chrono::nanoseconds start,
            WorkerTeam* team) noexcept MERKEL_REALTIME;

  /// Of the last step, in order of time.
  [[nodiscard]] std::span<const SpikeEvent> spikes() const noexcept { return spikes_.events(); }
  /// Neurons reset in the last step because their state had turned non-finite.
  [[nodiscard]] std::span<const SpikeEvent> resets() const noexcept;
  /// Spikes for which a step's buffer had no room, since construction.
  [[nodiscard]] std::uint64_t spikes_refused() const noexcept { return spikes_.refused(); }

  [[nodiscard]] std::size_t neurons() const noexcept { return drive_begin_.size(); }
  /// Current of every Hodgkin-Huxley afferent at the end of the last step, µA/cm².
  [[nodiscard]] std::span<const double> current_uA_per_cm2() const noexcept {
    return drive_.current_uA_per_cm2();
  }
  [[nodiscard]] const ReceptorDrive& drive() const noexcept { return drive_; }
  /// Neurons that the last step took, the others being at rest; in whole blocks.
  [[nodiscard]] std::size_t active_neurons() const noexcept;
  /// Whether the last step found nothing to do.
  [[nodiscard]] bool asleep() const noexcept { return asleep_; }

 private:
  ReceptorDrive drive_;
  std::variant<HodgkinHuxleyPopulation, EnergyDrivenNeurons> population_;
  std::vector<double> drive_begin_;
  SpikeBuffer spikes_;
  bool asleep_ = false;
};

}  // namespace merkel
