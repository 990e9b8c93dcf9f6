#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/precision.hpp"

namespace merkel {

/// How the membrane equations are stepped. Staggered methods have the gates half a step away from
/// the potential, which makes them second order at one rate evaluation a step.
enum class IntegrationMethod {
  kForwardEuler,      ///< first order, diverges from 70 µs
  kExponentialEuler,  ///< first order: gates and V by exponentials at the step's beginning (Brian2)
  kBackwardEuler,     ///< first order: gates by exponentials, then V implicitly (Arbor, NEURON)
  kRushLarsen,        ///< staggered, gates and V by exponentials
  kCrankNicolson,     ///< staggered, gates and V by Crank–Nicolson: the default
  kHeun,              ///< second order, diverges from 65 µs
  kRk4,               ///< fourth order, diverges from 85 µs
};

/// The name in scenes and on the command line, for example "crank_nicolson".
[[nodiscard]] std::string_view name_of(IntegrationMethod method) noexcept;
[[nodiscard]] std::string_view name_of(Precision precision) noexcept;
/// All names, in the order of the enumerations.
[[nodiscard]] const std::vector<std::string>& integration_method_names();
[[nodiscard]] const std::vector<std::string>& precision_names();
[[nodiscard]] std::optional<IntegrationMethod> integration_method_named(std::string_view name);

/// What is known of a method.
struct MethodTraits {
  bool explicit_scheme;    ///< diverges beyond largest_step_us, and with strong coupling
  double largest_step_us;  ///< from here on it diverges, or gives wrong spike counts
};
[[nodiscard]] MethodTraits traits_of(IntegrationMethod method) noexcept;

}  // namespace merkel
