#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace merkel {

/// A row of a device's text that is no line of plain numbers: its values as text, and what the
/// device calls each.
struct TextRow {
  static constexpr std::size_t kMaxValues = 2048;

  std::vector<std::string> names;  ///< empty: a list, without names
  std::vector<std::string> values;
};

/// Reads a line of JSON: an object or a list. Names of objects within are joined by '_', the values
/// of a list are numbered: {"t":1,"thumb":{"N":0.2},"p_kPa":[3,4]} has the names t, thumb_N, p1_kPa
/// and p2_kPa. null is nan. False if it is neither, is nested deeper than eight times or has too
/// many values. Bounded: memory in proportion to the line, no recursion.
[[nodiscard]] bool read_json_row(std::string_view line, TextRow& row);

/// "taxel17_kPa" for "taxel_kPa" and 17.
[[nodiscard]] std::string numbered_column(std::string_view name, std::size_t number);

}  // namespace merkel
