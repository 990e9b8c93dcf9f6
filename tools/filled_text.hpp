#pragma once

#include <string>
#include <string_view>

#include "tools/json_text.hpp"

namespace merkel {

/// A text of tools/texts, by its name without ".txt", filled with facts; without empty lines.
///
///     {path}            a value: of the innermost object that has it; {} the element itself, {@}
///     its
///                       number from 1; "-" if it is null
///     {path:FORMAT}     the same in a format of fmt; ~N: N digits, or all before the decimal point
///     {path#tick}       "1 tick", "2 ticks"; #tick was|ticks were: both forms
///     {>name path}      another text, filled with the value alone; without path, with the same
///     facts <condition?…>     only if it holds: path (not null, false, 0 or empty), +path (not
///     null),
///                       path=text; !: not; |: or
///     <path*…>          for each element of an array, or for an object, whose values come first
///
/// A path names members with / between them.
[[nodiscard]] std::string filled_text(std::string_view name, const Json& facts);

}  // namespace merkel
