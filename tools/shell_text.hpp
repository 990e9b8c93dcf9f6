#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace merkel {

/// Text between single quotes, for a shell. \param quote  what a quote in the text becomes; the
/// default is that of POSIX shells
[[nodiscard]] inline std::string shell_quoted(std::string_view text,
                                              std::string_view quote = R"('\'')") {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') {
      result += quote;
    } else {
      result += c;
    }
  }
  return result + "'";
}

/// A word of a command, in quotes where a POSIX shell needs them.
[[nodiscard]] inline std::string shell_word(std::string_view text) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_-./:=,+").find(c) != std::string_view::npos;
  };
  const bool bare = !text.empty() && std::all_of(text.begin(), text.end(), plain);
  return bare ? std::string(text) : shell_quoted(text);
}

}  // namespace merkel
