#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/neurons/neuron_arrays.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/neurons/step_call.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/spike_event.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// N neurons of one kind, stepped together.
///
/// The result, including the noise, does not depend on the instruction set, the number of threads
/// or the number of steps per call. The constructor allocates all memory. Real-time: yes, after
/// construction.
class NeuronGroup {
 public:
  virtual ~NeuronGroup() = default;
  NeuronGroup(const NeuronGroup&) = delete;
  NeuronGroup& operator=(const NeuronGroup&) = delete;

  /// Puts every neuron at rest and restarts the count of steps.
  void reset() noexcept MERKEL_REALTIME;

  /// Takes `steps` steps from `start` and appends the spikes to `spikes`, in no particular order.
  /// The input runs linearly from `input_begin` to `input_end` (N values each, in the unit of the
  /// kind).
  /// \param team  shares the work of large groups; null: one thread
  void advance(std::span<const double> input_begin, std::span<const double> input_end, int steps,
               std::chrono::nanoseconds start, SpikeBuffer& spikes,
               WorkerTeam* team = nullptr) noexcept MERKEL_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return neurons_; }
  [[nodiscard]] std::chrono::nanoseconds step() const noexcept { return step_; }
  /// Potential of a neuron, counted from 0, in mV; for integrate-and-fire neurons, in units of the
  /// threshold.
  [[nodiscard]] virtual double potential(std::size_t neuron) const noexcept = 0;
  /// Neurons that the last advance() reset because of a non-finite state, with the time of
  /// detection.
  [[nodiscard]] std::span<const SpikeEvent> resets() const noexcept { return resets_.events(); }
  /// Number of blocks of 16 neurons that the last advance() skipped because they were at rest.
  [[nodiscard]] std::size_t resting_blocks() const noexcept { return resting_blocks_; }
  /// Number of neurons in the blocks that the last advance() stepped.
  [[nodiscard]] std::size_t active_neurons() const noexcept;
  /// Whether the last advance() skipped all blocks; with the same input, the next call will too.
  [[nodiscard]] bool all_resting() const noexcept { return resting_blocks_ == blocks_of(neurons_); }

 protected:
  /// \param neurons  N ≥ 1
  /// \param patch  written into every spike
  /// \param first_neuron  number of the first neuron, used in spikes
  NeuronGroup(std::size_t neurons, std::chrono::nanoseconds step, std::uint16_t patch,
              std::uint32_t first_neuron);

  /// Marks all blocks as awake, after a state was changed from outside.
  void wake() noexcept { resting_blocks_ = 0; }
  [[nodiscard]] std::uint64_t steps_taken() const noexcept { return steps_taken_; }

 private:
  virtual void set_at_rest() noexcept = 0;
  /// \return the number of blocks that are at rest under this input and will be skipped
  virtual std::size_t take_input(std::span<const double> begin,
                                 std::span<const double> end) noexcept = 0;
  /// Calls the kernel. Thread: several at the same time, each with a separate part.
  virtual void step_part(const StepCall& part) noexcept = 0;

  std::size_t neurons_;
  std::chrono::nanoseconds step_;
  std::uint16_t patch_;
  std::uint32_t first_neuron_;
  std::uint64_t steps_taken_ = 0;  ///< since reset
  std::size_t resting_blocks_ = 0;
  SpikeBuffer resets_;
};

}  // namespace merkel
