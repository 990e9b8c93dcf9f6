#include "core/neuron/integration_method.hpp"

#include <algorithm>

namespace merkel {

std::string_view name_of(IntegrationMethod method) noexcept {
  switch (method) {
    case IntegrationMethod::kForwardEuler:
      return "forward_euler";
    case IntegrationMethod::kExponentialEuler:
      return "exponential_euler";
    case IntegrationMethod::kBackwardEuler:
      return "backward_euler";
    case IntegrationMethod::kRushLarsen:
      return "rush_larsen";
    case IntegrationMethod::kCrankNicolson:
      return "crank_nicolson";
    case IntegrationMethod::kHeun:
      return "heun";
    case IntegrationMethod::kRk4:
      return "rk4";
  }
  return "";
}

std::string_view name_of(Precision precision) noexcept {
  return precision == Precision::kDouble ? "double" : "float";
}

const std::vector<std::string>& integration_method_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (int i = 0; i <= static_cast<int>(IntegrationMethod::kRk4); ++i) {
      all.emplace_back(name_of(static_cast<IntegrationMethod>(i)));
    }
    return all;
  }();
  return names;
}

const std::vector<std::string>& precision_names() {
  static const std::vector<std::string> names = {std::string(name_of(Precision::kDouble)),
                                                 std::string(name_of(Precision::kFloat))};
  return names;
}

std::optional<IntegrationMethod> integration_method_named(std::string_view name) {
  const auto& names = integration_method_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<IntegrationMethod>(found - names.begin());
}

MethodTraits traits_of(IntegrationMethod method) noexcept {
  switch (method) {
    case IntegrationMethod::kForwardEuler:
      return {.explicit_scheme = true, .largest_step_us = 65.0};
    case IntegrationMethod::kHeun:
      return {.explicit_scheme = true, .largest_step_us = 60.0};
    case IntegrationMethod::kRk4:
      return {.explicit_scheme = true, .largest_step_us = 80.0};
    case IntegrationMethod::kExponentialEuler:
    case IntegrationMethod::kBackwardEuler:
      return {.explicit_scheme = false, .largest_step_us = 100.0};
    case IntegrationMethod::kRushLarsen:
    case IntegrationMethod::kCrankNicolson:
      return {.explicit_scheme = false, .largest_step_us = 200.0};
  }
  return {};
}

}  // namespace merkel
