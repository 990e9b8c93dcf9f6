#include "tools/connect/text_rows.hpp"

#include <algorithm>
#include <optional>

#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/frame_lines.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxFrameLines = 64;
constexpr std::size_t kMinRepeats = 2;

/// True if the first numbers of lines rise from line to line: they are rows with a clock.
bool counts_on(const std::vector<std::string>& lines) {
  std::optional<double> last;
  for (const std::string& line : lines) {
    std::string_view rest = line;
    const char separator =
        line.find_first_of(",;\t") == std::string::npos ? ' ' : line[line.find_first_of(",;\t")];
    const auto number = parse_csv_field(take_csv_part(rest, separator), false).number;
    if (!number || (last && *number <= *last)) return false;
    last = number;
  }
  return true;
}

/// Of JSON: an object or a list in each line.
std::optional<TextColumns> json_columns(const std::vector<std::string>& lines) {
  TextColumns columns;
  for (const std::string& line : lines) {
    TextRow row;
    if (line.find_first_of("{[") == 0 && read_json_row(line, row)) {
      columns.rows.push_back(std::move(row));
    }
  }
  if (2 * columns.rows.size() <= lines.size()) return std::nullopt;
  for (const TextRow& row : columns.rows) {
    for (std::size_t i = 0; i < row.values.size(); ++i) {
      std::size_t place = i;
      if (!row.names.empty()) {
        const auto key = std::find(columns.keys.begin(), columns.keys.end(), row.names[i]);
        place = static_cast<std::size_t>(key - columns.keys.begin());
        if (key == columns.keys.end()) columns.keys.push_back(row.names[i]);
      }
      if (columns.fields.size() <= place) columns.fields.resize(place + 1);
      columns.fields[place].push_back(parse_csv_field(row.values[i], false));
    }
  }
  return columns;
}

/// Of lines in a style; lines with other columns are left out.
TextColumns line_columns(const std::vector<std::string>& lines, const CsvStyle& style) {
  TextColumns columns{.style = style,
                      .options = "&separator=" + std::string(name_of_separator(style.separator)) +
                                 "&decimal=" + (style.decimal_comma ? "comma" : "point")};
  bool labelled = true;
  for (const std::string& line : lines) {
    const std::vector<CsvField> fields = csv_fields_of(line, style);
    const auto is_number = [](const CsvField& field) { return field.number.has_value(); };
    if (std::none_of(fields.begin(), fields.end(), is_number)) continue;
    if (columns.fields.empty()) columns.fields.resize(fields.size());
    if (columns.fields.size() != fields.size()) continue;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      columns.fields[i].push_back(fields[i]);
      labelled = labelled && (!fields[i].number || !fields[i].label.empty()) &&
                 fields[i].label == columns.fields[i].front().label;
    }
  }
  for (std::size_t i = 0; labelled && i < columns.fields.size(); ++i) {
    columns.keys.emplace_back(columns.fields[i].front().label);
  }
  return columns;
}

}  // namespace

std::size_t join_frames(std::vector<std::string>& lines) {
  std::vector<std::vector<std::string>> groups(1);
  for (const std::string& line : lines) {
    if (is_line_of_numbers(line)) {
      groups.back().push_back(line);
    } else if (!groups.back().empty()) {
      groups.emplace_back();
    }
  }
  std::erase_if(lines, [](const std::string& line) { return line.empty(); });
  if (groups.size() < kMinRepeats + 2) return 0;
  // The first and the last one may be cut.
  const std::size_t size = groups[1].size();
  std::vector<std::string> numbers;
  for (std::size_t i = 1; i + 1 < groups.size(); ++i) {
    if (groups[i].size() != size) return 0;
    numbers.insert(numbers.end(), groups[i].begin(), groups[i].end());
  }
  if (size < 2 || size > kMaxFrameLines || counts_on(numbers)) return 0;
  lines.clear();
  FrameLines frames(size);
  for (std::size_t i = 1; i + 1 < groups.size(); ++i) {
    static_cast<void>(frames.take(""));
    for (const std::string& line : groups[i]) {
      if (frames.take(line) == FrameLines::Result::kFrame) lines.push_back(frames.row());
    }
  }
  return size;
}

std::vector<TextColumns> columns_of_lines(const std::vector<std::string>& lines) {
  std::vector<TextColumns> all;
  if (auto json = json_columns(lines)) {
    all.push_back(std::move(*json));
    return all;
  }
  for (const CsvStyle& style : csv_styles(lines)) all.push_back(line_columns(lines, style));
  return all;
}

}  // namespace merkel
