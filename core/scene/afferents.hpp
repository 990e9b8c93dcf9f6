#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/neurons/connor_stevens/rate_current_table.hpp"
#include "core/neurons/neuron_group.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/adaptation.hpp"
#include "core/scene/model_parameters.hpp"

namespace merkel {

/// The afferents of one patch behind their receptors: a group of neurons, and in front of it, where
/// energy density drives them, a stage of adaptation. Real-time: yes, after construction.
class Afferents {
 public:
  /// Energy density → adapted drive I in Hz. With a table, the neurons then get the current under
  /// which they fire at I/(1 + compression·I), the rate that the refractory period of
  /// integrate-and-fire neurons leaves; else they get I.
  struct AdaptationStage {
    AdaptationParameters adaptation;
    std::shared_ptr<const RateCurrentTable> table;
    double compression_ms = 0.0;
  };

  /// The afferents of a patch of a model. \param neurons  of the patch
  /// \param table  of rate_current_table_of()
  /// \param first_neuron  number of the patch's first neuron in the model.  Real-time: no.
  [[nodiscard]] static Expected<Afferents, ParameterError> create(
      const ModelParameters& parameters, std::size_t patch, std::size_t neurons,
      const std::shared_ptr<const RateCurrentTable>& table, std::uint32_t first_neuron = 1);

  Afferents(std::unique_ptr<NeuronGroup> neurons, const std::optional<AdaptationStage>& stage);

  /// Back to rest, with no energy ever felt.
  void reset() noexcept MERKEL_REALTIME;

  /// Takes `steps` steps from `start`, the input running linearly from `input_begin` to `input_end`
  /// (N values each: currents in µA/cm², or mean energy densities in kPa where there is a stage of
  /// adaptation), and adds the spikes to `spikes`, in no particular order.
  /// \param team  shares the work of large groups; null: alone
  void advance(std::span<const double> input_begin, std::span<const double> input_end, int steps,
               std::chrono::nanoseconds start, SpikeBuffer& spikes,
               WorkerTeam* team) noexcept MERKEL_REALTIME;

  /// What drives a neuron, from 0, at the end of the last step: its current, or behind a stage of
  /// adaptation the drive in Hz. \param input  of that neuron
  [[nodiscard]] double drive(std::size_t neuron, double input) const noexcept {
    return adaptation_ ? drive_Hz_[neuron] : input;
  }
  [[nodiscard]] const NeuronGroup& neurons() const noexcept { return *neurons_; }
  /// Whether the last advance() had nothing to do and, with the same input, the next one has not.
  [[nodiscard]] bool all_resting() const noexcept {
    return neurons_->all_resting() && (!adaptation_ || adaptation_->at_rest());
  }

 private:
  /// The input of the neurons for a drive.
  [[nodiscard]] double input_of(double drive_Hz) const noexcept;

  std::unique_ptr<NeuronGroup> neurons_;
  std::optional<Adaptation> adaptation_;
  std::shared_ptr<const RateCurrentTable> table_;
  double compression_s_ = 0.0;
  std::vector<double> drive_Hz_;
  std::vector<double> begin_, end_;  ///< input of the neurons behind a stage of adaptation
};

/// The inverse f–I curve of a model's Connor-Stevens neurons; null for other neurons. Fails where
/// the neuron never fires steadily. Real-time: no; it simulates each current for some seconds.
[[nodiscard]] Expected<std::shared_ptr<const RateCurrentTable>, ParameterError>
rate_current_table_of(const ModelParameters& parameters);

}  // namespace merkel
