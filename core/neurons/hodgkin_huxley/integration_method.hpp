#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/precision.hpp"

namespace merkel {

/// The largest fraction of a membrane's charge that neighbours may exchange per step. Below it, the
/// neighbours' potentials are extrapolated to the middle of the step, which is second order. Above
/// it, the exchange would have to use the neighbours' potentials at the beginning of the step and
/// the neuron's own at the end: stable at any gain, but first order.
inline constexpr double kLargestExchange = 0.5;

/// From this step on, Crank–Nicolson steps the gates by exponentials: (α+β)·dt can exceed 2, where
/// its own rule would overshoot [0, 1].
inline constexpr double kExponentialGates_ms = 0.04;

/// How the membrane equations are stepped. Staggered methods keep gates and potential half a step
/// apart, which gives second order with one rate evaluation per step.
enum class IntegrationMethod {
  kForwardEuler,      ///< first order, diverges from 75 µs
  kExponentialEuler,  ///< first order: gates and V by exponentials at the beginning (Brian2)
  kBackwardEuler,     ///< first order: gates by exponentials, then V implicitly (Arbor, NEURON)
  kRushLarsen,        ///< staggered, gates and V by exponentials
  kCrankNicolson,     ///< staggered, gates and V by Crank–Nicolson: the default
  kHeun,              ///< second order, diverges from 70 µs
  kRk4,               ///< fourth order, diverges from 95 µs
  /// Fourth order: staggered, with one rate evaluation per step and the slopes of the last three
  /// steps. Diverges from 70 µs.
  kStaggeredMultistep,
};

/// The names in scenes and on the command line, in the order of the enumerators.
inline constexpr std::string_view kIntegrationMethods[] = {
    "forward_euler", "exponential_euler",  "backward_euler",
    "rush_larsen",   "crank_nicolson",     "heun",
    "rk4",           "staggered_multistep"};
inline constexpr std::string_view kPrecisions[] = {"double", "float"};
[[nodiscard]] std::string_view name_of(IntegrationMethod method) noexcept;
[[nodiscard]] std::string_view name_of(Precision precision) noexcept;
[[nodiscard]] const std::vector<std::string>& integration_method_names();
[[nodiscard]] std::optional<IntegrationMethod> integration_method_named(std::string_view name);

}  // namespace merkel
