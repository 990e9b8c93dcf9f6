#pragma once

#include <algorithm>
#include <cstddef>

#include "core/neurons/hodgkin_huxley/kernel/membrane_kernel.hpp"
#include "core/realtime_tag.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// Shares the steps of a population between the threads of a team, in whole blocks, where there is
/// enough of them. Calls step(first, last, peers) for the neurons [first, last) of every part;
/// peers are the team, null where the part is alone. Real-time: yes.
/// \param team  null: alone
template <class Step>
void share_steps(std::size_t neurons, WorkerTeam* team, Step step) noexcept MERKEL_REALTIME {
  /// Below so many neurons a part, sharing the work costs more than it saves.
  constexpr std::size_t kLeastPart = 1024;
  const std::size_t worth = std::max<std::size_t>(neurons / kLeastPart, 1);
  const int parts = team == nullptr
                        ? 1
                        : static_cast<int>(std::min(worth, static_cast<std::size_t>(team->size())));
  if (parts == 1) {
    step(std::size_t{0}, neurons, static_cast<WorkerTeam*>(nullptr));
    return;
  }
  struct Work {
    std::size_t neurons;
    int parts;
    WorkerTeam* team;
    Step& step;

    [[nodiscard]] std::size_t border(int part) const noexcept {
      const std::size_t blocks = (neurons + kNeuronBlock - 1) / kNeuronBlock;
      const std::size_t block =
          blocks * static_cast<std::size_t>(part) / static_cast<std::size_t>(parts);
      return std::min(block * kNeuronBlock, neurons);
    }
  } work{neurons, parts, team, step};
  team->run(
      parts,
      [](void* context, int part) noexcept {
        const Work& w = *static_cast<const Work*>(context);
        w.step(w.border(part), w.border(part + 1), w.team);
      },
      &work);
}

}  // namespace merkel
