#include "core/parameters/field.hpp"

#include <type_traits>

namespace merkel {
namespace {

std::string fault_of_time(const Field& field, std::chrono::nanoseconds value) {
  const double amount = static_cast<double>(value.count()) / nanoseconds_of_unit(field.unit);
  if (field.range.holds(amount)) return {};
  const std::string unit = field.unit == "µs" ? "microseconds" : "milliseconds";
  if (amount > field.range.high) {
    return "must be at most " + readable_decimal(field.range.high) + " " + unit;
  }
  if (value.count() > 0) {
    return "must be at least " + readable_decimal(field.range.low) + " " + unit;
  }
  return (field.range.holds(0.0) ? "must be zero or a positive number of "
                                 : "must be a positive number of ") +
         unit;
}

/// The error in a value, by type. Texts, switches, seeds and choices are always valid.
struct FaultOf {
  const Field& field;

  std::string operator()(double value) const { return field.range.fault(value); }
  std::string operator()(int value) const { return field.range.fault(std::int64_t{value}); }
  std::string operator()(std::int64_t value) const { return field.range.fault(value); }
  std::string operator()(std::chrono::nanoseconds value) const {
    return fault_of_time(field, value);
  }
  std::string operator()(const Position& value) const {
    const std::string fault = field.range.fault(value.x_mm);
    return fault.empty() ? field.range.fault(value.y_mm) : fault;
  }
  template <class T>
  std::string operator()(const std::vector<T>& values) const {
    std::string fault;
    for (std::size_t i = 0; fault.empty() && i < values.size(); ++i) fault = (*this)(values[i]);
    return fault;
  }
  template <class T>
  std::string operator()(const std::optional<T>& value) const {
    return value ? (*this)(*value) : std::string();
  }
  std::string operator()(std::uint64_t seed) const {
    if (seed <= kMaxSeed) return {};
    return "must be a whole number from 0 to " + std::to_string(kMaxSeed) + ", but is " +
           std::to_string(seed);
  }
  std::string operator()(bool /*value*/) const { return {}; }
  std::string operator()(const std::string& /*value*/) const { return {}; }
};

}  // namespace

std::string BoundField::name() const { return std::string(table).append(".").append(field->key); }

void bind_fields(const FieldTable& table, void* parameters, BoundFields& fields) {
  for (const Field& field : table.fields) {
    fields.push_back({.table = table.name,
                      .field = &field,
                      .value = field.in(parameters),
                      .words = {field.range.words.begin(), field.range.words.end()}});
  }
}

std::string fault_of(const BoundField& field) {
  return std::visit(
      [&](const auto& value) -> std::string {
        if constexpr (std::is_same_v<decltype(value), const Choice&>) {
          return {};
        } else {
          return FaultOf{*field.field}(*value);
        }
      },
      field.value);
}

double nanoseconds_of_unit(std::string_view unit) noexcept { return unit == "µs" ? 1e3 : 1e6; }

}  // namespace merkel
