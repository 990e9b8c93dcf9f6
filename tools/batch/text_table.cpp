#include "tools/batch/text_table.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "drivers/files/column_text.hpp"
#include "drivers/files/csv_text.hpp"

namespace merkel {
namespace {

std::string_view trimmed(std::string_view cell) {
  const auto begin = cell.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return cell.substr(begin, cell.find_last_not_of(" \t") - begin + 1);
}

/// Reads lines of cells.
class TableText {
 public:
  explicit TableText(std::string_view text) : text_(text) {}

  [[nodiscard]] bool ended() const { return place_ >= text_.size(); }
  /// The number of the line read last, from 1.
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] bool open_quote() const { return open_quote_; }

  std::vector<std::string> next() {
    line_ = next_line_;
    std::vector<std::string> cells;
    do {
      cells.push_back(cell());
    } while (!ended() && text_[place_++] == ',');
    ++next_line_;
    return cells;
  }

 private:
  /// Ends at the comma or the end of the line.
  std::string cell() {
    while (!ended() && text_[place_] == ' ') ++place_;
    if (ended() || text_[place_] != '"') {
      const auto end = std::min(text_.find_first_of(",\n", place_), text_.size());
      std::string_view plain = text_.substr(place_, end - place_);
      if (plain.ends_with('\r')) plain.remove_suffix(1);
      place_ = end;
      return std::string(trimmed(plain));
    }
    std::string quoted;
    for (++place_; !ended(); ++place_) {
      if (text_[place_] == '\n') ++next_line_;
      if (text_[place_] != '"') {
        quoted.push_back(text_[place_]);
      } else if (place_ + 1 < text_.size() && text_[place_ + 1] == '"') {
        quoted.push_back(text_[place_++]);
      } else {
        place_ = std::min(text_.find_first_of(",\n", place_), text_.size());
        return quoted;
      }
    }
    open_quote_ = true;
    return quoted;
  }

  std::string_view text_;
  std::size_t place_ = 0;
  std::size_t line_ = 0;
  std::size_t next_line_ = 1;
  bool open_quote_ = false;
};

}  // namespace

Expected<TextTable, SetupError> parse_table(std::string_view text, const std::string& name) {
  text = without_byte_order_mark(text);
  TextTable table;
  TableText lines(text);
  while (!lines.ended()) {
    std::vector<std::string> cells = lines.next();
    const std::string where = name + ":" + std::to_string(lines.line()) + ": ";
    if (lines.open_quote()) return bad_input(where + "a quote is not closed: add \" to its end");
    if (cells[0].starts_with('#')) continue;
    if (std::all_of(cells.begin(), cells.end(), [](const auto& cell) { return cell.empty(); })) {
      continue;
    }
    if (table.columns.empty()) {
      table.columns = std::move(cells);
      continue;
    }
    if (cells.size() != table.columns.size()) {
      return bad_input(where + "the line has " + std::to_string(cells.size()) +
                       " cells, but the header has " + std::to_string(table.columns.size()) +
                       ": put a cell that contains a comma in quotes");
    }
    table.rows.push_back(std::move(cells));
  }
  if (table.columns.empty()) return bad_input(name + " is empty: write a header and a line a job");
  return table;
}

std::string table_line(const std::vector<std::string>& cells) {
  std::string line;
  for (const std::string& cell : cells) {
    if (&cell != cells.data()) line.push_back(',');
    append_field(line, cell);
  }
  return line + "\n";
}

}  // namespace merkel
