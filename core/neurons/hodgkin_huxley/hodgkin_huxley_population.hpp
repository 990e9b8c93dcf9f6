#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/integration_method.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/neurons/hodgkin_huxley/membranes.hpp"
#include "core/neurons/hodgkin_huxley/quiescence.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/realtime_tag.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// N Hodgkin-Huxley neurons stepped together, with or without a network between them.
///
/// C·V̇ = Σ ionic + I + κΣ_j w_nj(V_j − V_n) (Eq. 11, mended). A spike is an upward crossing of the
/// threshold; its time is interpolated within the step. A neuron whose state turns non-finite is
/// reset to rest and reported before its neighbours can see it. Blocks of 16 neurons that are at
/// rest under a constant current are skipped until something changes. The result depends neither on
/// the instruction set nor on the number of threads. Real-time: advance() and reset() are;
/// construction allocates all there is.
class HodgkinHuxleyPopulation {
 public:
  struct Parameters {
    HodgkinHuxley neuron;
    IntegrationMethod method = IntegrationMethod::kCrankNicolson;
    Precision precision = Precision::kDouble;
    std::chrono::nanoseconds step{25'000};
    std::uint16_t patch = 0;     ///< written into every spike
    bool freeze_resting = true;  ///< skip blocks at rest
  };

  /// \param neurons  N ≥ 1
  /// \param network  a grid of N neurons, or none; one whose gain is 0 counts as none
  HodgkinHuxleyPopulation(const Parameters& parameters, std::size_t neurons,
                          const std::optional<LatticeCoupling>& network);

  /// Puts every neuron at its exact rest.
  void reset() noexcept MERKEL_REALTIME;

  /// Takes `steps` membrane steps from `start`, the injected current running linearly from
  /// `current_begin` to `current_end` (N values each, µA/cm²), and adds the spikes to `spikes`, in
  /// no particular order. \param team  shares the work where there is enough of it; null: alone
  void advance(std::span<const double> current_begin, std::span<const double> current_end,
               int steps, std::chrono::nanoseconds start, SpikeBuffer& spikes,
               WorkerTeam* team = nullptr) noexcept MERKEL_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept;
  [[nodiscard]] double potential_mV(std::size_t neuron) const noexcept;
  [[nodiscard]] Gates gates(std::size_t neuron) const noexcept;
  /// Sets one neuron's state; for tests and for starting from a recorded state.
  void set_state(std::size_t neuron, double V_mV, const Gates& gates) noexcept;
  /// Neurons reset in the last advance() because their state had turned non-finite, as events with
  /// the time at which that was found.
  [[nodiscard]] std::span<const SpikeEvent> resets() const noexcept { return resets_.events(); }
  /// Blocks of 16 neurons that the last advance() skipped because they were at rest.
  [[nodiscard]] std::size_t resting_blocks() const noexcept { return resting_blocks_; }
  /// Neurons in the blocks that the last advance() stepped.
  [[nodiscard]] std::size_t active_neurons() const noexcept {
    return size() - std::min(size(), resting_blocks_ * kNeuronBlock);
  }
  /// Whether it skipped all: under the same currents, the next one will do nothing.
  [[nodiscard]] bool all_resting() const noexcept {
    return resting_blocks_ == (size() + kNeuronBlock - 1) / kNeuronBlock;
  }

 private:
  Parameters parameters_;
  std::variant<Membranes<double>, Membranes<float>> membranes_;
  std::optional<Quiescence> quiescence_;  ///< none where blocks at rest are stepped too
  SpikeBuffer resets_;
  std::size_t resting_blocks_ = 0;
};

}  // namespace merkel
