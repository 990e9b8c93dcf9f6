#include "core/neurons/hodgkin_huxley/quiescence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace merkel {

Quiescence::Quiescence(std::shared_ptr<const RestingStates> resting_states, std::size_t neurons,
                       std::size_t columns)
    : resting_states_(std::move(resting_states)),
      neurons_(neurons),
      columns_(columns),
      reach_(blocks_of(columns)),
      current_(neurons),
      resting_(blocks_of(neurons)),
      frozen_(resting_.size()) {}

void Quiescence::wake() noexcept { std::fill(frozen_.begin(), frozen_.end(), std::uint8_t{0}); }

bool Quiescence::at_rest(const RestingStates::State& state, double current) const noexcept {
  if (!resting_states_->covers(current)) return false;
  const RestingStates::State fixed = resting_states_->at(current);
  return std::fabs(state.V - fixed.V) < kEpsilon_mV &&
         std::fabs(state.gates.n - fixed.gates.n) < kEpsilonGate &&
         std::fabs(state.gates.m - fixed.gates.m) < kEpsilonGate &&
         std::fabs(state.gates.h - fixed.gates.h) < kEpsilonGate;
}

std::size_t Quiescence::freeze() noexcept {
  std::size_t count = 0;
  for (std::size_t block = 0; block < resting_.size(); ++block) {
    const std::size_t first = block > reach_ ? block - reach_ : 0;
    const std::size_t last = std::min(block + reach_ + 1, resting_.size());
    const bool all = std::all_of(resting_.begin() + static_cast<std::ptrdiff_t>(first),
                                 resting_.begin() + static_cast<std::ptrdiff_t>(last),
                                 [](std::uint8_t rests) { return rests != 0; });
    frozen_[block] = all ? 1 : 0;
    count += all ? 1 : 0;
  }
  return count;
}

}  // namespace merkel
