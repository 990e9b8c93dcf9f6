#pragma once

#include <chrono>
#include <cstdint>
#include <span>

#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/neurons/connor_stevens/connor_stevens_kernel.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/realtime_tag.hpp"
#include "core/simd/aligned_array.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// N Connor-Stevens neurons stepped together. The result, noise included, depends neither on the
/// instruction set, nor on the number of threads, nor on how many steps a call takes. A step of
/// 50 µs gives rates within 0.3 % of one of 20 µs. Real-time: advance() and reset() are;
/// construction allocates all there is.
class ConnorStevensPopulation {
 public:
  struct Parameters {
    ConnorStevens neuron;
    std::chrono::nanoseconds step{50'000};
    double holding_current_uA_per_cm2 = 0.0;  ///< under which the neurons rest at first
    std::uint16_t patch = 0;                  ///< written into every spike
  };

  /// \param parameters  valid.  \param neurons  N ≥ 1
  ConnorStevensPopulation(const Parameters& parameters, std::size_t neurons);

  /// Puts every neuron where it rests under the holding current, with the noise of the first step
  /// to come.
  void reset() noexcept MERKEL_REALTIME;

  /// Takes `steps` steps from `start`, the injected current running linearly from `current_begin`
  /// to `current_end` (N values each, µA/cm²), and adds the spikes to `spikes`, in no particular
  /// order. \param team  shares the work where there is enough of it; null: alone
  void advance(std::span<const double> current_begin, std::span<const double> current_end,
               int steps, std::chrono::nanoseconds start, SpikeBuffer& spikes,
               WorkerTeam* team = nullptr) noexcept MERKEL_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return neurons_; }
  [[nodiscard]] double potential_mV(std::size_t neuron) const noexcept { return V_[neuron]; }

 private:
  /// Of a call of the kernel, but for which neurons it steps and who observes.
  [[nodiscard]] ConnorStevensArguments arguments(int steps) noexcept;

  Parameters parameters_;
  std::size_t neurons_;
  GateTable gate_table_;
  AlignedArray<double> V_, current_begin_, current_change_;
  AlignedArray<double> gates_[GateTable::kGates];
  AlignedArray<std::uint64_t> noise_key_;
  double resting_V_mV_ = -68.0;
  double resting_gates_[GateTable::kGates] = {};
  std::uint64_t steps_taken_ = 0;
};

}  // namespace merkel
