#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/neurons/neuron_arrays.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// Receives the rare events of a kernel while it steps. All calls are real-time.
class StepObserver {
 public:
  /// \param neuron    from 0
  /// \param step      from the first of the call
  /// \param fraction  of the step at which the spike occurs
  virtual void spiked(std::size_t neuron, int step, double fraction) noexcept = 0;
  /// The state of a neuron turned non-finite in a step, and the kernel reset it to rest.
  virtual void reset(std::size_t neuron, int step) noexcept = 0;

 protected:
  ~StepObserver() = default;
};

/// Which neurons take which steps; the same for all kernels.
struct StepCall {
  std::size_t first = 0;  ///< neurons [first, last) are stepped; first is at the start of a block
  std::size_t last = 0;
  int steps = 0;
  std::uint64_t steps_before = 0;  ///< steps since reset, before this call
  StepObserver* observer = nullptr;
  WorkerTeam* peers = nullptr;  ///< threads that step the other parts; null: none
};

/// Calls step(run) for each run of blocks that are not at rest.
/// \param resting  by block of the group
template <class Step>
void for_each_awake_run(const StepCall& call, std::span<const std::uint8_t> resting,
                        Step step) noexcept {
  StepCall run = call;
  run.last = call.first;
  const auto flush = [&] {
    if (run.first < run.last) step(run);
  };
  for (std::size_t first = call.first; first < call.last; first += kNeuronBlock) {
    if (resting[first / kNeuronBlock] != 0) {
      flush();
      run.first = run.last = first + kNeuronBlock;
      continue;
    }
    run.last = std::min(first + kNeuronBlock, call.last);
  }
  flush();
}

}  // namespace merkel
