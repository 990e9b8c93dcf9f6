#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>

#include "core/units.hpp"
#include "drivers/sessions/session_records.hpp"

namespace merkel::python {

/// The type of a column in Python: times and lengths of time are in s, enumerators are numbers.
template <class Member>
struct CellOf {
  using Type = Member;
};
template <>
struct CellOf<std::chrono::nanoseconds> {
  using Type = double;
};
template <class Member>
requires std::is_enum_v<Member>
struct CellOf<Member> {
  using Type = std::underlying_type_t<Member>;
};
template <class Record, class Access>
using Cell = typename CellOf<std::remove_cvref_t<decltype(std::declval<const Access&>()(
    std::declval<const Record&>()))>>::Type;

/// Calls work(column, a value of its type, its place in the row) for each column of a record.
/// \return the size of the row
template <class Record, class Work>
constexpr std::size_t for_each_cell(const Work& work) {
  std::size_t place = 0;
  for_each_column(SessionStreamOf<Record>::kColumns, [&]<class Access>(const Column<Access>& each) {
    using Type = Cell<Record, Access>;
    place = (place + sizeof(Type) - 1) / sizeof(Type) * sizeof(Type);
    work(each, Type{}, place);
    place += sizeof(Type);
  });
  return (place + sizeof(double) - 1) / sizeof(double) * sizeof(double);
}

/// A row of a structured array that Python sees: the columns of a record. Neurons count from 1
/// through all patches, probes and patches from 0, as in every file that merkel writes.
template <class Record>
struct Row {
  static constexpr std::size_t kSize = for_each_cell<Record>([](const auto&, auto, std::size_t) {});
  alignas(double) std::array<std::byte, kSize> bytes;

  /// The value of a column, by the name of the record's column.
  template <class Type>
  [[nodiscard]] Type get(std::string_view name) const {
    Type value{};
    for_each_cell<Record>([&](const auto& column, auto cell, std::size_t place) {
      if constexpr (std::is_same_v<decltype(cell), Type>) {
        if (column.name == name) std::memcpy(&value, &bytes[place], sizeof value);
      }
    });
    return value;
  }
};

/// "time_ns" becomes "time_s", "force_mN" becomes "force_N".
template <class Access>
std::string name_in_python(const Column<Access>& column) {
  std::string name(column.name);
  if (column.unit == "ns") name.replace(name.size() - 2, 2, "s");
  if (column.unit == "mN") name.replace(name.size() - 2, 2, "N");
  return name;
}

/// A row with times counted from `zero`.
template <class Record>
[[nodiscard]] Row<Record> row_of(const Record& record, std::chrono::nanoseconds zero) {
  Row<Record> row{};
  for_each_cell<Record>([&](const auto& column, auto value, std::size_t place) {
    using Type = decltype(value);
    const auto& member = column.access(record);
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(member)>, std::chrono::nanoseconds>) {
      const bool instant = !column.name_of_seconds.empty();
      value = units::s_from(instant ? member - zero : member);
    } else {
      value = static_cast<Type>(member);
      if constexpr (std::is_same_v<Type, double>) {
        if (column.unit == "mN") value = units::N_from_mN(value);
      }
    }
    std::memcpy(&row.bytes[place], &value, sizeof value);
  });
  return row;
}

/// Makes the rows of a record known to numpy. Call once, when the module is loaded.
template <class Record>
void register_row() {
  namespace detail = pybind11::detail;
  std::vector<std::string> names;
  names.reserve(32);
  std::vector<detail::field_descriptor> fields;
  for_each_cell<Record>([&](const auto& column, auto value, std::size_t place) {
    using Type = decltype(value);
    names.push_back(name_in_python(column));
    fields.push_back({names.back().c_str(), static_cast<pybind11::ssize_t>(place), sizeof(Type),
                      pybind11::format_descriptor<Type>::format(),
                      detail::npy_format_descriptor<Type>::dtype()});
  });
  detail::npy_format_descriptor<Row<Record>>::register_dtype(std::move(fields));
}

}  // namespace merkel::python
