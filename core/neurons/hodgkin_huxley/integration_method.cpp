#include "core/neurons/hodgkin_huxley/integration_method.hpp"

#include <algorithm>
#include <iterator>

namespace merkel {

std::string_view name_of(IntegrationMethod method) noexcept {
  return kIntegrationMethods[static_cast<std::size_t>(method)];
}

std::string_view name_of(Precision precision) noexcept {
  return kPrecisions[static_cast<std::size_t>(precision)];
}

const std::vector<std::string>& integration_method_names() {
  static const std::vector<std::string> names(std::begin(kIntegrationMethods),
                                              std::end(kIntegrationMethods));
  return names;
}

std::optional<IntegrationMethod> integration_method_named(std::string_view name) {
  const auto& names = integration_method_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<IntegrationMethod>(found - names.begin());
}

double largest_step_ms(IntegrationMethod method, double exchange_per_ms) noexcept {
  const auto of_explicit = [=](double alone_ms, double interval) {
    return 1.0 / (1.0 / alone_ms + 2.0 * exchange_per_ms / interval);
  };
  const auto of_implicit = [=](double alone_ms) {
    return exchange_per_ms > 0.0 ? std::min(alone_ms, kLargestExchange / exchange_per_ms)
                                 : alone_ms;
  };
  // Neighbours are extrapolated, the outflow is implicit: measured on the lattice.
  constexpr double kStaggeredInterval = 0.5;
  switch (method) {
    case IntegrationMethod::kForwardEuler:
    case IntegrationMethod::kHeun:
      return of_explicit(0.055, 2.0);
    case IntegrationMethod::kRk4:
      return of_explicit(0.08, 2.785);
    case IntegrationMethod::kStaggeredMultistep:
      return of_explicit(0.0625, kStaggeredInterval);
    case IntegrationMethod::kExponentialEuler:
      return of_implicit(0.055);
    case IntegrationMethod::kBackwardEuler:
    case IntegrationMethod::kRushLarsen:
    case IntegrationMethod::kCrankNicolson:
      return of_implicit(0.125);
  }
  return 0.0;
}

}  // namespace merkel
