#include "tools/studies/report/csv_table.hpp"

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/column_text.hpp"

namespace merkel {
namespace {

std::string joined(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) {
    if (!text.empty()) text += ',';
    text += shortest_decimal(value);
  }
  return text;
}

}  // namespace

Expected<CsvTable, SetupError> CsvTable::create(const std::string& path, const std::string& header,
                                                bool overwrite) {
  auto file = OutputFile::create(path, overwrite);
  if (!file) return Unexpected<SetupError>(file.error());
  CsvTable table(std::move(*file));
  if (!table.file_.write(header + "\n")) return unavailable(table.file_.error());
  table.file_.end_header();
  return table;
}

// A write error is reported when the table is closed.
void CsvTable::row(std::initializer_list<double> values) {
  static_cast<void>(file_.write(joined(values) + "\n"));
}

void CsvTable::row(std::initializer_list<std::string_view> texts,
                   std::initializer_list<double> values) {
  std::string line;
  for (const std::string_view text : texts) {
    append_field(line, text);
    line += ',';
  }
  static_cast<void>(file_.write(line + joined(values) + "\n"));
}

Expected<void, SetupError> CsvTable::close() {
  if (!file_.close()) return unavailable(file_.error());
  return {};
}

}  // namespace merkel
