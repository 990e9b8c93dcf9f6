#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "core/records/column.hpp"
#include "drivers/sessions/session_format.hpp"

namespace merkel {

// Channels of a stream and values of an item, from the columns of a record.

/// True if the numbers of a stream cannot represent all nanoseconds of an instant.
template <class Value, class Access>
constexpr bool in_parts(const Column<Access>& column) noexcept {
  return std::is_same_v<Value, double> && !column.name_of_seconds.empty();
}

/// The channels of a stream whose samples have such values.
template <class Value, const auto& columns>
inline constexpr auto kSessionChannels = [] {
  constexpr std::size_t kCount = [] {
    std::size_t count = 0;
    for_each_column(columns, [&](const auto& each) { count += in_parts<Value>(each) ? 2 : 1; });
    return count;
  }();
  std::array<SessionStream::Channel, kCount> channels{};
  std::size_t next = 0;
  for_each_column(columns, [&](const auto& each) {
    if (in_parts<Value>(each)) {
      channels[next++] = {each.name_of_seconds, "s", each.meaning};
      channels[next++] = {each.name, each.unit, "beyond the whole seconds"};
    } else {
      channels[next++] = {each.name, each.unit, each.meaning, each.later};
    }
  });
  return channels;
}();

/// For a channel that the file lacks; 0 if files of older versions lack it.
inline constexpr std::int8_t kMissingValue = -1;

/// Puts the members of a record into the values of its stream.
template <class Columns, class Record, class Values>
void columns_to_values(const Columns& columns, const Record& record, Values& values) {
  using Value = typename Values::value_type;
  std::size_t next = 0;
  for_each_column(columns, [&](const auto& each) {
    const auto& member = each.access(record);
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(member)>, std::chrono::nanoseconds>) {
      const auto whole = std::chrono::floor<std::chrono::seconds>(member);
      const bool parts = in_parts<Value>(each);
      if (parts) values[next++] = static_cast<Value>(whole.count());
      values[next++] = static_cast<Value>((parts ? member - whole : member).count());
    } else {
      values[next++] = static_cast<Value>(member);
    }
  });
}

/// Sets a member that is a whole number, an enumerator or a length of time. False if the value is
/// not valid.
template <class Value, class Access, class Member>
bool to_whole(Value value, const Column<Access>& column, Member& member) {
  constexpr double kLargestWhole = 9e15;  // doubles up to it are exact
  if constexpr (std::is_same_v<Value, double>) {
    if (!(std::fabs(value) <= kLargestWhole) || value != std::floor(value)) return false;
  }
  const auto whole = static_cast<std::int64_t>(value);
  if constexpr (!std::is_enum_v<Member>) {
    if (std::is_unsigned_v<Member> && whole < 0) return false;
    if (sizeof(Member) < sizeof whole &&
        whole > static_cast<std::int64_t>(std::numeric_limits<Member>::max())) {
      return false;
    }
  }
  if (static_cast<double>(whole) < column.least || static_cast<double>(whole) > column.largest) {
    return false;
  }
  member = static_cast<Member>(whole);
  return true;
}

/// Sets an instant from its whole seconds and the nanoseconds beyond them.
inline bool to_time(double whole_s, double rest_ns, std::chrono::nanoseconds& time) {
  constexpr double kLargest_s = 4e9;  // the difference of two times fits into 64-bit nanoseconds
  if (!(std::fabs(whole_s) <= kLargest_s) || whole_s != std::floor(whole_s) ||
      !(rest_ns >= 0.0 && rest_ns <= 999'999'999.0) || rest_ns != std::floor(rest_ns)) {
    return false;
  }
  time = std::chrono::seconds{static_cast<std::int64_t>(whole_s)} +
         std::chrono::nanoseconds{static_cast<std::int64_t>(rest_ns)};
  return true;
}

/// The inverse of columns_to_values(). Checks whole numbers, enumerators and times; false if one is
/// not valid.
template <class Columns, class Record, class Values>
[[nodiscard]] bool values_to_columns(const Columns& columns, const Values& values, Record& record) {
  using Value = typename Values::value_type;
  std::size_t next = 0;
  bool valid = true;
  for_each_column(columns, [&](const auto& each) {
    auto& member = each.access(record);
    using Member = std::remove_cvref_t<decltype(member)>;
    Value value = values[next++];
    if constexpr (std::is_same_v<Member, std::chrono::nanoseconds>) {
      if (in_parts<Value>(each)) {
        valid = to_time(static_cast<double>(value), static_cast<double>(values[next++]), member) &&
                valid;
        return;
      }
      std::int64_t count = 0;
      valid = to_whole(value, each, count) && valid;
      member = std::chrono::nanoseconds{count};
    } else if constexpr (std::is_floating_point_v<Member>) {
      member = static_cast<Member>(value);
    } else {
      valid = to_whole(value, each, member) && valid;
    }
  });
  return valid;
}

}  // namespace merkel
