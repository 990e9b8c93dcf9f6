#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "core/neurons/connor_stevens/connor_stevens_population.hpp"
#include "core/neurons/connor_stevens/rate_current_table.hpp"
#include "core/neurons/integrate_and_fire/integrate_and_fire_population.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/adaptation.hpp"
#include "core/records/spike_event.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// Neurons that the mean energy density in an afferent's receptive field drives: energy →
/// adaptation → drive in Hz → spikes. Integrate-and-fire neurons take the drive I as it is; others
/// take the current under which they fire at R = I/(1 + compression·I), the rate that the
/// integrate-and-fire neuron's refractory period would leave.
/// Real-time: yes, after construction.
class EnergyDrivenNeurons {
 public:
  struct ConnorStevensDrive {
    ConnorStevensPopulation::Parameters population;
    std::shared_ptr<const RateCurrentTable> table;  ///< of the same neuron and step
    double compression_ms = 4.0;
  };
  struct Parameters {
    AdaptationParameters adaptation;
    std::variant<IntegrateAndFirePopulation::Parameters, ConnorStevensDrive> neurons;
  };

  EnergyDrivenNeurons(const Parameters& parameters, std::size_t neurons);

  void reset() noexcept MERKEL_REALTIME;
  /// Takes `steps` steps from `start`, the mean energy densities running linearly from
  /// `energy_begin` to `energy_end` (N values each, kPa), and adds the spikes to `spikes`, in no
  /// particular order. \param team  shares the work where there is enough of it; null: alone
  void advance(std::span<const double> energy_begin, std::span<const double> energy_end, int steps,
               std::chrono::nanoseconds start, SpikeBuffer& spikes,
               WorkerTeam* team) noexcept MERKEL_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return drive_end_.size(); }
  /// Of every afferent at the end of the last step, Hz.
  [[nodiscard]] std::span<const double> drive_Hz() const noexcept { return drive_; }
  /// Noise never rests, and the states cannot turn non-finite.
  [[nodiscard]] bool all_resting() const noexcept { return false; }
  [[nodiscard]] std::size_t active_neurons() const noexcept { return size(); }
  [[nodiscard]] std::span<const SpikeEvent> resets() const noexcept { return {}; }

 private:
  using Population = std::variant<IntegrateAndFirePopulation, ConnorStevensPopulation>;
  [[nodiscard]] static Population make_population(const Parameters& parameters,
                                                  std::size_t neurons);
  [[nodiscard]] double resting_input() const noexcept;

  Adaptation adaptation_;
  Population population_;
  std::chrono::nanoseconds step_;
  std::shared_ptr<const RateCurrentTable> table_;  ///< null where the drive is the input
  double compression_s_ = 0.0;
  std::vector<double> drive_;
  std::vector<double> drive_begin_, drive_end_;  ///< what goes into the neurons
};

}  // namespace merkel
