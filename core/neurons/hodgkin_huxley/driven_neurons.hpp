#pragma once

#include <optional>
#include <vector>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"

namespace merkel {

/// The spikes of uncoupled neurons, or those of a network, under constant currents, from rest.
struct DrivenNeurons {
  std::vector<SpikeEvent> spikes;  ///< in order of time
  std::size_t resets = 0;          ///< states that became non-finite
};

/// \param current  of each neuron, µA/cm².  \param duration_ms  rounded down to whole steps
/// Real-time: no.
[[nodiscard]] DrivenNeurons drive_neurons(const std::vector<double>& current, double duration_ms,
                                          IntegrationMethod method, Precision precision,
                                          double step_us,
                                          const std::optional<LatticeCoupling>& network = {},
                                          const HodgkinHuxley& neuron = {});

}  // namespace merkel
