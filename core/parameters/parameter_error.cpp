#include "core/parameters/parameter_error.hpp"

#include <utility>

namespace merkel {

void ParameterCheck::fail(std::string_view key, std::string reason) {
  if (!first_) first_ = ParameterError{.key = std::string(key), .reason = std::move(reason)};
}

ParameterCheck& ParameterCheck::fields(const BoundFields& fields) {
  for (const BoundField& field : fields) {
    if (std::string fault = fault_of(field); !fault.empty()) fail(field.name(), std::move(fault));
  }
  return *this;
}

ParameterCheck& ParameterCheck::number(std::string_view key, double value, const Range& range) {
  if (std::string fault = range.fault(value); !fault.empty()) fail(key, std::move(fault));
  return *this;
}

ParameterCheck& ParameterCheck::require(bool condition, std::string_view key,
                                        std::string_view reason) {
  if (!condition) fail(key, std::string(reason));
  return *this;
}

ParameterCheck& ParameterCheck::also(const Expected<void, ParameterError>& other) {
  if (!other && !first_) first_ = other.error();
  return *this;
}

Expected<void, ParameterError> ParameterCheck::result() const {
  if (first_) return Unexpected<ParameterError>(*first_);
  return {};
}

}  // namespace merkel
