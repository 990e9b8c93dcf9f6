#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/contact_state.hpp"
#include "core/records/neuron_sample.hpp"
#include "core/records/spike_event.hpp"
#include "core/scene/model_parameters.hpp"

namespace merkel {

class SlidingContact;
class TactilePatch;
class WorkerTeam;

/// Patches of skin, their afferents and the probes that press on them: contact → stress → energy
/// density → current → membrane → spikes, one tick at a time.
///
/// Construct, reset, step: create() allocates all memory.
class TactileModel {
 public:
  using Parameters = ModelParameters;

  TactileModel(TactileModel&&) noexcept;
  TactileModel& operator=(TactileModel&&) noexcept;
  ~TactileModel();

  /// Fails with the first parameter that is out of range. Real-time: no.
  [[nodiscard]] static Expected<TactileModel, ParameterError> create(const Parameters& parameters);

  /// Shares the work of step() among threads from now on; null: none. The spikes stay
  /// bit-identical.
  /// \param team  borrowed
  /// Real-time: no.
  void share_work(WorkerTeam* team) noexcept;

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
                            const ContactInput& input) const noexcept MERKEL_REALTIME;

  [[nodiscard]] const Parameters& parameters() const noexcept;
  [[nodiscard]] std::size_t indenters() const noexcept;
  [[nodiscard]] std::span<const TactilePatch> patches() const noexcept;
  /// Number of neurons in all patches.
  [[nodiscard]] std::size_t neurons() const noexcept;
  /// Drive and potential of a neuron at the end of the last step.
  /// \param number  across all patches, from 1 to neurons(). Real-time: yes.
  [[nodiscard]] NeuronSample neuron(std::uint32_t number) const noexcept MERKEL_REALTIME;
  /// Number of receptors in all patches.
  [[nodiscard]] std::size_t receptors() const noexcept;
  /// Whether an indenter touched a patch in the last step. Real-time: yes.
  [[nodiscard]] bool touched(std::size_t patch) const noexcept;
  /// The contact of each indenter at the end of the last step.
  [[nodiscard]] std::span<const Press> presses() const noexcept;
  /// The deepest press of each indenter since reset.
  [[nodiscard]] std::span<const Press> deepest() const noexcept;
  /// The smallest distance so far between the rims of two spheres' contacts on one patch at the
  /// same time, in units of the larger radius; infinite if there was none. Below 1, each contact
  /// lies on skin that the other has bent, which superposition does not model.
  [[nodiscard]] double closest_rims() const noexcept;
  /// The contact of an indenter that is a sliding surface; null for others.
  [[nodiscard]] const SlidingContact* sliding(std::size_t indenter) const noexcept;
  /// Neurons reset in the last step because of a non-finite state, with the time of detection.
  [[nodiscard]] std::span<const SpikeEvent> resets() const noexcept;
  /// Spikes dropped since construction because a tick's buffer was full.
  [[nodiscard]] std::uint64_t spikes_refused() const noexcept;

 private:
  class State;
  explicit TactileModel(std::unique_ptr<State> state) noexcept;

  std::unique_ptr<State> state_;
};

}  // namespace merkel
