#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/contact/neighbour_depths.hpp"
#include "core/contact/sliding_contact.hpp"
#include "core/contact/taxel_field.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/spike_event.hpp"
#include "core/scene/drive_reach.hpp"
#include "core/scene/model_parameters.hpp"
#include "core/scene/tactile_patch.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// Patches of skin, their afferents and the probes that press on them: contact → stress → energy
/// density → current → membrane → spikes, one tick at a time.
///
/// Construct, reset, step: create() allocates all memory.
class TactileModel {
 public:
  using Parameters = ModelParameters;

  /// Fails with the first parameter that is out of range. Real-time: no.
  [[nodiscard]] static Expected<TactileModel, ParameterError> create(const Parameters& parameters);

  /// Shares the work of step() among threads from now on; null: none. The spikes stay
  /// bit-identical.
  /// \param team  borrowed
  /// Real-time: no.
  void share_work(WorkerTeam* team) noexcept { team_ = team; }

  /// Resets to rest, without contact. Real-time: yes.
  void reset() noexcept MERKEL_REALTIME;

  /// Advances by one tick from `start`. The contacts apply at the tick's end, one per indenter;
  /// the currents run linearly from the previous tick's to the new ones.
  /// \return the tick's spikes in order of time, valid until the next call.  Real-time: yes.
  std::span<SpikeEvent> step(std::span<const ContactInput> contacts_at_end,
                             std::chrono::nanoseconds start) noexcept MERKEL_REALTIME;

  /// Sets the pressures of a tactile array from the next step on; all are 0 before.
  /// \param pressures_kPa  one per taxel; none for other tips.  Real-time: yes.
  void set_taxels(std::size_t indenter,
                  std::span<const float> pressures_kPa) noexcept MERKEL_REALTIME;

  /// The contact that an input makes with an indenter. Real-time: yes.
  [[nodiscard]] Press press(std::size_t indenter,
                            const ContactInput& input) const noexcept MERKEL_REALTIME {
    return tips_[indenter].press(input);
  }

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t indenters() const noexcept { return tips_.size(); }
  [[nodiscard]] std::span<const TactilePatch> patches() const noexcept { return patches_; }
  /// Number of neurons in all patches.
  [[nodiscard]] std::size_t neurons() const noexcept;
  /// Drive and potential of a neuron at the end of the last step.
  /// \param number  across all patches, from 1 to neurons(). Real-time: yes.
  [[nodiscard]] NeuronSample neuron(std::uint32_t number) const noexcept MERKEL_REALTIME;
  /// Number of receptors in all patches.
  [[nodiscard]] std::size_t receptors() const noexcept;
  /// Whether an indenter touched a patch in the last step. Real-time: yes.
  [[nodiscard]] bool touched(std::size_t patch) const noexcept { return !touching_[patch].empty(); }
  /// The contact of each indenter at the end of the last step.
  [[nodiscard]] std::span<const Press> presses() const noexcept { return presses_; }
  /// The deepest press of each indenter since reset.
  [[nodiscard]] std::span<const Press> deepest() const noexcept { return deepest_; }
  /// The smallest distance so far between the rims of two spheres' contacts on one patch at the
  /// same time, in units of the larger radius; infinite if there was none. Below 1, each contact
  /// lies on skin that the other has bent, which superposition does not model.
  [[nodiscard]] double closest_rims() const noexcept { return closest_rims_; }
  /// The contact of an indenter that is a sliding surface; null for others.
  [[nodiscard]] const SlidingContact* sliding(std::size_t indenter) const noexcept {
    return sliding_[indenter].get();
  }
  /// Neurons reset in the last step because of a non-finite state, with the time of detection.
  [[nodiscard]] std::span<const SpikeEvent> resets() const noexcept { return resets_.events(); }
  /// Spikes dropped since construction because a tick's buffer was full.
  [[nodiscard]] std::uint64_t spikes_refused() const noexcept;

 private:
  TactileModel(const Parameters& parameters, std::vector<TactilePatch> patches);
  void update_rim_distance(std::span<const PlacedContact> touching) noexcept;
  /// Writes presses_; depth-controlled tips on one patch share the skin that they displace.
  void press_tips(std::span<const ContactInput> contacts) noexcept;
  void touch(std::size_t indenter) noexcept;
  /// Steps the patches and solves the contacts of sliding surfaces, which serve later ticks.
  void step_patches(std::chrono::nanoseconds start) noexcept;
  void step_patch(std::size_t patch, WorkerTeam* team) noexcept;

  Parameters parameters_;
  int steps_;  ///< of the neurons in a tick
  std::vector<TipContact> tips_;
  std::vector<std::unique_ptr<SlidingContact>> sliding_;  ///< of each tip; null: does not slide
  std::vector<DriveReach> reach_of_tip_;
  std::vector<std::unique_ptr<TaxelField>> taxels_;  ///< by indenter; null: not a tactile array
  std::vector<TactilePatch> patches_;
  std::vector<std::vector<PlacedContact>> touching_;  ///< by patch
  std::vector<Press> presses_;                        ///< of this tick
  std::vector<NeighbourPress> neighbours_;            ///< on one patch
  std::vector<Press> deepest_;
  double closest_rims_ = std::numeric_limits<double>::infinity();
  WorkerTeam* team_ = nullptr;
  std::chrono::nanoseconds start_{0};  ///< of the step in progress
  std::unique_ptr<std::atomic<std::size_t>>
      next_part_;  ///< next contact to solve or patch to step, shared by the threads
  SpikeBuffer spikes_;
  SpikeBuffer resets_;
};

}  // namespace merkel
