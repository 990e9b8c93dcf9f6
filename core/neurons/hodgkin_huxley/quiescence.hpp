#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/neurons/hodgkin_huxley/resting_states.hpp"
#include "core/neurons/neuron_arrays.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// Finds blocks of neurons that need no stepping because their state does not change.
///
/// A neuron is at rest if its current does not change within the call, and all four of its states
/// lie within ε of the stable fixed point under that current plus the exchange with its neighbours.
/// A block is skipped if all its neurons and all blocks coupled to it are at rest. (A constant V is
/// not sufficient: V is also almost constant shortly before a spike.) ε is 1e-3 mV for V and 1e-5
/// for the gates. Real-time: yes, after construction.
class Quiescence {
 public:
  static constexpr double kEpsilon_mV = 1e-3;
  static constexpr double kEpsilonGate = 1e-5;

  /// \param resting_states  of the neuron; shared by all groups of equal neurons
  /// \param columns  of the grid on which neighbours are coupled; 0 without a network
  Quiescence(std::shared_ptr<const RestingStates> resting_states, std::size_t neurons,
             std::size_t columns);

  /// Marks all blocks as awake.
  void wake() noexcept;

  /// Finds the blocks to skip.
  /// \param state  neuron → RestingStates::State
  /// \param exchange  neuron → current from its neighbours, µA/cm²
  /// \return their number; frozen() marks them
  template <class State, class Exchange>
  std::size_t find(std::span<const double> current_begin, std::span<const double> current_end,
                   State state, Exchange exchange) noexcept MERKEL_REALTIME {
    for (std::size_t block = 0; block < resting_.size(); ++block) {
      const std::size_t first = block * kNeuronBlock;
      const std::size_t last = std::min(first + kNeuronBlock, neurons_);
      bool rests = true;
      for (std::size_t i = first; rests && i < last; ++i) {
        rests = current_begin[i] == current_end[i];
      }
      // A block skipped last time has not changed: with the same current, it is still at rest.
      const bool known = frozen_[block] != 0 && columns_ == 0;
      for (std::size_t i = first; rests && i < last; ++i) {
        if (known && current_begin[i] == current_[i]) continue;
        rests = at_rest(state(i), current_begin[i] + exchange(i));
      }
      for (std::size_t i = first; i < last; ++i) current_[i] = current_end[i];
      resting_[block] = rests ? 1 : 0;
    }
    return freeze();
  }

  /// By block: 1 = skip.
  [[nodiscard]] const std::uint8_t* frozen() const noexcept { return frozen_.data(); }

 private:
  [[nodiscard]] bool at_rest(const RestingStates::State& state, double current) const noexcept;
  std::size_t freeze() noexcept;

  std::shared_ptr<const RestingStates> resting_states_;
  std::size_t neurons_;
  std::size_t columns_;
  std::size_t reach_;  ///< of the coupling, in blocks
  std::vector<double> current_;
  std::vector<std::uint8_t> resting_;
  std::vector<std::uint8_t> frozen_;
};

}  // namespace merkel
