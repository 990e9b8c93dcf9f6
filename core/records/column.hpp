#pragma once

#include <cstddef>
#include <limits>
#include <string_view>
#include <type_traits>

namespace merkel {

/// A column of a record: a whole number, an enumerator, a physical number, an instant or a length
/// of time, as the type of its member says.
template <class Access>
struct Column {
  std::string_view name;
  std::string_view unit;  ///< empty: a plain number
  std::string_view meaning;
  Access access;  ///< access(record) refers to the member, in a constant or changeable record
  /// Of whole numbers and lengths of time: the valid values. The type of the member limits them
  /// too.
  double least = -std::numeric_limits<double>::infinity();
  double largest = std::numeric_limits<double>::infinity();
  /// Of an instant: the column of its whole seconds, in formats whose numbers cannot represent all
  /// its nanoseconds. The column `name` then has the rest.
  std::string_view name_of_seconds = {};
  bool later = false;  ///< files of older versions lack it; it is then 0
};

/// The access to a member, of a pointer to it; any other access is returned as it is.
template <class Access>
constexpr auto access_to(Access access) {
  if constexpr (std::is_member_object_pointer_v<Access>) {
    return [access](auto& record) -> auto& { return record.*access; };
  } else {
    return access;
  }
}

/// \param access  as in Column, or a pointer to the member
template <class Access>
constexpr auto column(std::string_view name, std::string_view unit, std::string_view meaning,
                      Access access) {
  return Column<decltype(access_to(access))>{name, unit, meaning, access_to(access)};
}

/// A whole number within limits, or an enumerator.
template <class Access>
constexpr auto limited_column(std::string_view name, std::string_view meaning, Access access,
                              double least, double largest) {
  auto made = column(name, "", meaning, access);
  made.least = least;
  made.largest = largest;
  return made;
}

/// An instant in ns.
template <class Access>
constexpr auto time_column(std::string_view name, std::string_view name_of_seconds,
                           std::string_view meaning, Access access) {
  auto made = column(name, "ns", meaning, access);
  made.name_of_seconds = name_of_seconds;
  return made;
}

/// A column that files of older versions lack. Its values are not negative.
template <class Access>
constexpr Column<Access> later_column(Column<Access> made) {
  made.later = true;
  made.least = 0.0;
  return made;
}

/// The columns of a record, in order: a function that calls its argument with all of them. (With a
/// tuple, sources took up to a third more time to compile.)
template <class... Each>
constexpr auto column_list(Each... each) {
  return [each...](const auto& work) { return work(each...); };
}

/// Calls work(column) for each column, in order.
template <class Columns, class Work>
constexpr void for_each_column(const Columns& columns, const Work& work) {
  columns([&](const auto&... each) { (work(each), ...); });
}

template <class Columns>
constexpr std::size_t count_of_columns(const Columns& columns) {
  return columns([](const auto&... each) { return sizeof...(each); });
}

/// The columns of two lists.
template <class First, class Second>
constexpr auto joined_columns(const First& first, const Second& second) {
  return first([&](const auto&... before) {
    return second([&](const auto&... after) { return column_list(before..., after...); });
  });
}

/// Columns of a record, for the record of which it is a member.
template <class Columns, class Outer>
constexpr auto columns_within(const Columns& columns, Outer outer) {
  const auto moved = [outer = access_to(outer)](const auto& inner) {
    const auto access = [ outer, of = inner.access ](auto& record) -> auto& {
      return of(outer(record));
    };
    return Column<std::remove_const_t<decltype(access)>>{
        inner.name,  inner.unit,    inner.meaning,         access,
        inner.least, inner.largest, inner.name_of_seconds, inner.later};
  };
  return columns([&](const auto&... each) { return column_list(moved(each)...); });
}

}  // namespace merkel
