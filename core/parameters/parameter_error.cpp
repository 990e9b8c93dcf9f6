#include "core/parameters/parameter_error.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace merkel {

std::string shortest_decimal(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

void ParameterCheck::fail(std::string_view key, std::string reason) {
  if (!first_) first_ = ParameterError{.key = std::string(key), .reason = std::move(reason)};
}

ParameterCheck& ParameterCheck::positive(std::string_view key, double value) {
  if (!(std::isfinite(value) && value > 0.0)) {
    fail(key, "must be a positive number, but is " + shortest_decimal(value));
  }
  return *this;
}

ParameterCheck& ParameterCheck::positive_or_infinite(std::string_view key, double value) {
  if (!(value > 0.0)) {
    fail(key, "must be a positive number or inf, but is " + shortest_decimal(value));
  }
  return *this;
}

ParameterCheck& ParameterCheck::not_negative(std::string_view key, double value) {
  if (!(std::isfinite(value) && value >= 0.0)) {
    fail(key, "must be zero or a positive number, but is " + shortest_decimal(value));
  }
  return *this;
}

ParameterCheck& ParameterCheck::finite(std::string_view key, double value) {
  if (!std::isfinite(value)) {
    fail(key, "must be a finite number, but is " + shortest_decimal(value));
  }
  return *this;
}

ParameterCheck& ParameterCheck::in_range(std::string_view key, double value, double low,
                                         double high) {
  if (!(value >= low && value < high)) {
    fail(key, "must be at least " + shortest_decimal(low) + " and below " + shortest_decimal(high) +
                  ", but is " + shortest_decimal(value));
  }
  return *this;
}

ParameterCheck& ParameterCheck::whole_in_range(std::string_view key, long long value, long long low,
                                               long long high) {
  if (value < low || value > high) {
    fail(key, "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high) +
                  ", but is " + std::to_string(value));
  }
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
