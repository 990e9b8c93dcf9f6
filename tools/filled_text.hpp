#pragma once

#include <string>
#include <string_view>

#include "tools/json_text.hpp"

namespace merkel {

/// A text of tools/texts, by its name without ".txt", filled with facts; without empty lines.
///
///     {path}           a value, of the innermost object that has it; "-" if it is null
///     {} and {@}       the element itself, and its number from 1
///     {path:FORMAT}    a value in a format of fmt; ~N: N digits, or all before the decimal point
///     {path#tick}      "1 tick", "2 ticks"; with #tick was|ticks were both forms are given
///     {>name path}     another text, filled with the value alone; without a path, with all facts
///     <condition?…>    only if it holds: path (not null, false, 0 or empty), +path (not null),
///                      path=text; !: not; |: or
///     <path*…>         for each element of an array, or for an object; its values come first
///
/// A path names members with / between them.
[[nodiscard]] std::string filled_text(std::string_view name, const Json& facts);

/// The same with its empty lines, for a report.
[[nodiscard]] std::string filled_page(std::string_view name, const Json& facts = {});

}  // namespace merkel
