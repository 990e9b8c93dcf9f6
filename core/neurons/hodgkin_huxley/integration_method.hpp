#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/precision.hpp"

namespace merkel {

/// The part of a membrane's charge that neighbours may exchange in a step: as long as it is less,
/// they are extrapolated to the step's middle, which is second order. Beyond, they would be taken
/// as at its beginning against the own potential at its end: stable at any gain, but first order.
inline constexpr double kLargestExchange = 0.5;

/// How the membrane equations are stepped. Staggered methods have the gates half a step away from
/// the potential, which makes them second order at one rate evaluation a step.
enum class IntegrationMethod {
  kForwardEuler,      ///< first order, diverges from 75 µs
  kExponentialEuler,  ///< first order: gates and V by exponentials at the step's beginning (Brian2)
  kBackwardEuler,     ///< first order: gates by exponentials, then V implicitly (Arbor, NEURON)
  kRushLarsen,        ///< staggered, gates and V by exponentials
  kCrankNicolson,     ///< staggered, gates and V by Crank–Nicolson: the default
  kHeun,              ///< second order, diverges from 70 µs
  kRk4,               ///< fourth order, diverges from 95 µs
  /// Fourth order: staggered, one rate evaluation a step and the slopes of the last three. Diverges
  /// from 70 µs.
  kStaggeredMultistep,
};

/// The names in scenes and on the command line, in the order of the enumerations.
inline constexpr std::string_view kIntegrationMethods[] = {
    "forward_euler", "exponential_euler",  "backward_euler",
    "rush_larsen",   "crank_nicolson",     "heun",
    "rk4",           "staggered_multistep"};
inline constexpr std::string_view kPrecisions[] = {"double", "float"};
[[nodiscard]] std::string_view name_of(IntegrationMethod method) noexcept;
[[nodiscard]] std::string_view name_of(Precision precision) noexcept;
[[nodiscard]] const std::vector<std::string>& integration_method_names();
[[nodiscard]] std::optional<IntegrationMethod> integration_method_named(std::string_view name);

/// The largest step at which a method neither diverges nor gives wrong spike counts, ms.
///
/// Of a single neuron under up to 50 µA/cm² it is a measured figure. The network makes it smaller:
/// an explicit method diverges where dt·(λ_membrane + λ_network) passes the end of its stability
/// interval (2; RK4 2.785), λ_network ≤ 2·Σg/C; the others never diverge, but beyond dt·Σg/C = ½
/// they lag behind the neighbours so far that the network's rates fall.
/// \param exchange_per_ms  the largest Σg/C of a neuron's coupling to its neighbours, 1/ms
[[nodiscard]] double largest_step_ms(IntegrationMethod method, double exchange_per_ms) noexcept;

}  // namespace merkel
