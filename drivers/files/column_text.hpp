#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/records/column.hpp"
#include "drivers/files/csv_text.hpp"

namespace merkel {

// Records as CSV, from their columns: times and lengths of time in seconds, enumerators as words,
// numbers as the shortest decimals that read back as the same value.

/// Appends a text as one field: in quotes if a reader of CSV would take it for several (RFC 4180),
/// or drop its blanks.
inline void append_field(std::string& text, std::string_view field) {
  if (field.find_first_of(",\"\r\n") == std::string_view::npos && !field.starts_with(' ')) {
    text.append(field);
    return;
  }
  text += '"';
  for (const char c : field) text.append(c == '"' ? 2 : 1, c);
  text += '"';
}

/// Appends the text of a member.
template <class Member>
void append_value(std::string& text, const Member& member) {
  if constexpr (std::is_same_v<Member, std::chrono::nanoseconds>) {
    append_seconds(text, member);
  } else if constexpr (std::is_enum_v<Member>) {
    append_field(text, name_of(member));
  } else if constexpr (std::is_floating_point_v<Member>) {
    text.append(shortest_decimal(static_cast<double>(member)));
  } else {
    text.append(std::to_string(member));
  }
}

/// The names of the columns, separated by commas; "time_ns" becomes "time_s".
template <class Columns>
[[nodiscard]] std::string csv_header(const Columns& columns) {
  std::string header;
  for_each_column(columns, [&](const auto& each) {
    header.append(header.empty() ? "" : ",");
    const bool time = each.unit == "ns" && each.name.ends_with("_ns");
    header.append(time ? each.name.substr(0, each.name.size() - 2) : each.name);
    if (time) header += 's';
  });
  return header;
}

/// Appends the members of a record, separated by commas.
template <class Columns, class Record>
void append_csv(std::string& text, const Columns& columns, const Record& record) {
  bool first = true;
  for_each_column(columns, [&](const auto& each) {
    if (!std::exchange(first, false)) text += ',';
    append_value(text, each.access(record));
  });
}

}  // namespace merkel
