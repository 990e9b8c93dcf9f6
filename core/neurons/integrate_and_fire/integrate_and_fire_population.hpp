#pragma once

#include <chrono>
#include <cstdint>
#include <span>

#include "core/neurons/integrate_and_fire/integrate_and_fire.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/realtime_tag.hpp"
#include "core/simd/aligned_array.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// N integrate-and-fire neurons stepped together. The result, noise included, depends neither on
/// the instruction set, nor on the number of threads, nor on how many steps a call takes.
/// Real-time: advance() and reset() are; construction allocates all there is.
class IntegrateAndFirePopulation {
 public:
  struct Parameters {
    IntegrateAndFire neuron;
    std::chrono::nanoseconds step{500'000};
    std::uint16_t patch = 0;  ///< written into every spike
  };

  /// \param parameters  valid.  \param neurons  N ≥ 1
  IntegrateAndFirePopulation(const Parameters& parameters, std::size_t neurons);

  /// Puts every neuron at its reset value, out of its refractory period, with the noise of the
  /// first step to come.
  void reset() noexcept MERKEL_REALTIME;

  /// Takes `steps` steps from `start`, the drive running linearly from `current_begin` to
  /// `current_end` (N values each, Hz), and adds the spikes to `spikes`, in no particular order.
  /// \param team  shares the work where there is enough of it; null: alone
  void advance(std::span<const double> current_begin, std::span<const double> current_end,
               int steps, std::chrono::nanoseconds start, SpikeBuffer& spikes,
               WorkerTeam* team = nullptr) noexcept MERKEL_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return neurons_; }
  /// v of a neuron, from 0.
  [[nodiscard]] double potential(std::size_t neuron) const noexcept { return v_[neuron]; }

 private:
  Parameters parameters_;
  std::size_t neurons_;
  AlignedArray<double> v_, refractory_left_, current_begin_, current_change_;
  AlignedArray<std::uint64_t> noise_key_;
  std::uint64_t steps_taken_ = 0;
};

}  // namespace merkel
