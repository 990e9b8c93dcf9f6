#pragma once

#include <cstdio>
#include <utility>

#include <fmt/core.h>

namespace merkel {

/// Prints a text in a format of fmt. Does not throw if it cannot be written, as fmt::print() does.
template <class... Values>
void print_text(std::FILE* to, fmt::format_string<Values...> format, Values&&... values) {
  std::fputs(fmt::format(format, std::forward<Values>(values)...).c_str(), to);
}

}  // namespace merkel
