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

}  // namespace merkel
