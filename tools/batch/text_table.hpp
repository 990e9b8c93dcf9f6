#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// A CSV table of text with a header (RFC 4180: a cell with commas is in quotes).
struct TextTable {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows = {};  ///< as long as the header
};

/// Parses a table; lines without text and lines that start with # are ignored. Accepts arbitrary
/// bytes. \param name  for errors, which name the line
[[nodiscard]] Expected<TextTable, SetupError> parse_table(std::string_view text,
                                                          const std::string& name);

/// A line of a table, with its end.
[[nodiscard]] std::string table_line(const std::vector<std::string>& cells);

}  // namespace merkel
