#include "tools/studies/score/json_fields.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "drivers/parsed_number.hpp"

namespace merkel {

void refuse_field(const std::string& field, const std::string& reason) {
  throw JsonFault{field + " " + reason};
}

JsonFields::JsonFields(const Json& object, std::string name)
    : object_(object), name_(std::move(name)) {
  if (!object.is_object()) refuse_field(name_, "must be an object with named fields");
}

const Json* JsonFields::find(const std::string& key) {
  known_.push_back(key);
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

const Json& JsonFields::need(const std::string& key) {
  const Json* const found = find(key);
  if (found == nullptr) refuse_field(full(key), "is missing");
  return *found;
}

std::string JsonFields::text(const std::string& key) {
  const Json* const found = find(key);
  if (found == nullptr) return "";
  if (!found->is_string()) refuse_field(full(key), "must be a text in quotes");
  return found->get<std::string>();
}

bool JsonFields::truth(const std::string& key, bool otherwise) {
  const Json* const found = find(key);
  if (found == nullptr) return otherwise;
  if (!found->is_boolean()) refuse_field(full(key), "must be true or false");
  return found->get<bool>();
}

double JsonFields::number(const std::string& key, double otherwise, bool may_be_zero) {
  const Json* const found = find(key);
  return found == nullptr ? otherwise : number_of(*found, full(key), may_be_zero);
}

std::vector<double> JsonFields::numbers(const std::string& key, bool may_be_negative) {
  return numbers_of(need(key), full(key), may_be_negative);
}

double JsonFields::number_of(const Json& value, const std::string& field, bool may_be_zero,
                             bool may_be_negative) {
  if (!value.is_number()) refuse_field(field, "must be a number");
  const double number = value.get<double>();
  if (!std::isfinite(number)) refuse_field(field, "must be a finite number");
  if (may_be_negative || number > 0.0 || (may_be_zero && number == 0.0)) return number;
  refuse_field(field, "must be " + std::string(may_be_zero ? "zero or positive" : "positive") +
                          ", but is " + shortest_decimal(number));
}

std::vector<double> JsonFields::numbers_of(const Json& value, const std::string& field,
                                           bool may_be_negative) {
  if (!value.is_array() || value.empty()) refuse_field(field, "must be a list of numbers");
  std::vector<double> numbers;
  for (const Json& item : value) {
    numbers.push_back(number_of(item, field, true, may_be_negative));
  }
  return numbers;
}

void JsonFields::finish() {
  for (const auto& [key, value] : object_.items()) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    if (parsed_number<double>(key)) {
      refuse_field(full(key), "has no unit: add one to the name, as in \"20Hz\" or \"0.65mm\"");
    }
    refuse_field(
        "the field " + full(key),
        "is unknown" + did_you_mean(key, known_, "; the known ones are " + listed(known_)));
  }
}

double quantity(const std::string& key, const std::string& unit, const std::string& field,
                const std::string& example) {
  const std::size_t begin = key.rfind('_') == std::string::npos ? 0 : key.rfind('_') + 1;
  double value = 0.0;
  const char* const first = key.data() + begin;
  const char* const last = key.data() + key.size();
  const auto [end, error] = std::from_chars(first, last, value);
  if (error != std::errc() || std::string(end, last) != unit) {
    refuse_field(field, "must end in a number with its unit, as in \"" + example + "\"");
  }
  if (!(std::isfinite(value) && value > 0.0)) {
    refuse_field(field, "must have a positive number before " + unit);
  }
  return value;
}

bool ends_in(const std::string& key, const std::string& unit) {
  return key.size() > unit.size() && key.compare(key.size() - unit.size(), unit.size(), unit) == 0;
}

}  // namespace merkel
