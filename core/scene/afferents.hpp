#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/neurons/hodgkin_huxley/resting_states.hpp"
#include "core/neurons/neuron_group.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/adaptation.hpp"
#include "core/scene/model_parameters.hpp"

namespace merkel {

/// What the afferents of all patches of a model have in common; null for other kinds of neurons.
struct AfferentTables {
  std::shared_ptr<const RestingStates> resting_states;  ///< Hodgkin-Huxley, if frozen at rest
  double largest_step_alone_ms = 0.0;  ///< Hodgkin-Huxley, of a neuron without neighbours
};

/// Computes them. Real-time: no.
[[nodiscard]] AfferentTables afferent_tables_of(const ModelParameters& parameters);

/// The afferents of one patch: a group of neurons and, if energy density drives them, a preceding
/// stage of adaptation. Real-time: yes, after construction.
class Afferents {
 public:
  /// The afferents of a patch of a model.
  /// \param neurons  in the patch
  /// \param tables  from afferent_tables_of() with these parameters
  /// \param first_neuron  number of the patch's first neuron in the model
  /// Real-time: no.
  [[nodiscard]] static Expected<Afferents, ParameterError> create(const ModelParameters& parameters,
                                                                  std::size_t patch,
                                                                  std::size_t neurons,
                                                                  const AfferentTables& tables,
                                                                  std::uint32_t first_neuron = 1);

  /// \param adaptation  energy density → the drive in Hz that the neurons receive
  Afferents(std::unique_ptr<NeuronGroup> neurons,
            const std::optional<AdaptationParameters>& adaptation);

  /// Resets to rest and clears the adaptation.
  void reset() noexcept MERKEL_REALTIME;

  /// Takes `steps` steps from `start` and appends the spikes to `spikes`, in no particular order.
  /// The input runs linearly from `input_begin` to `input_end` (N values each: currents in µA/cm²,
  /// or mean energy densities in kPa with a stage of adaptation).
  /// \param team  shares the work of large groups; null: one thread
  void advance(std::span<const double> input_begin, std::span<const double> input_end, int steps,
               std::chrono::nanoseconds start, SpikeBuffer& spikes,
               WorkerTeam* team) noexcept MERKEL_REALTIME;

  /// The drive of a neuron, counted from 0, at the end of the last step: its current, or with a
  /// stage of adaptation the drive in Hz.
  /// \param input  of that neuron
  [[nodiscard]] double drive(std::size_t neuron, double input) const noexcept {
    return adaptation_ ? drive_Hz_[neuron] : input;
  }
  [[nodiscard]] const NeuronGroup& neurons() const noexcept { return *neurons_; }
  /// Whether the last advance() had nothing to do; with the same input, neither has the next one.
  [[nodiscard]] bool all_resting() const noexcept {
    return neurons_->all_resting() && (!adaptation_ || adaptation_->at_rest());
  }

 private:
  std::unique_ptr<NeuronGroup> neurons_;
  std::optional<Adaptation> adaptation_;
  std::vector<double> drive_Hz_;
  std::vector<double> last_drive_Hz_;  ///< of the step before
};

}  // namespace merkel
