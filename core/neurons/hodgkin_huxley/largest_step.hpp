#pragma once

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/integration_method.hpp"

namespace merkel {

/// The largest step at which a method neither diverges nor gives wrong spike counts for a single
/// neuron at up to 50 µA/cm², ms. Known for the published neuron; others are driven with ever
/// smaller steps, for some 10 ms, and compared with Crank-Nicolson at 5 µs. 0: no step of at least
/// 1 µs will do. Real-time: no.
[[nodiscard]] double largest_step_alone_ms(const HodgkinHuxley& neuron, IntegrationMethod method);

/// The same in a network, which reduces it: an explicit method diverges where
/// dt·(λ_membrane + λ_network) exceeds its stability interval (2; RK4 2.785), with λ_network ≤
/// 2·Σg/C. The other methods never diverge, but beyond dt·Σg/C = ½ they lag so far behind the
/// neighbours that the network's rates fall.
/// \param alone_ms         of a single neuron
/// \param exchange_per_ms  the largest Σg/C of a neuron's coupling to its neighbours, 1/ms
[[nodiscard]] double largest_step_ms(IntegrationMethod method, double alone_ms,
                                     double exchange_per_ms) noexcept;

}  // namespace merkel
