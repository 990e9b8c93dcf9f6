// Arbitrary bytes as the table of jobs of `merkel batch` (CSV). Built and run by fuzz.sh with
// libFuzzer.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "tools/batch/text_table.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto table = parse_table(text, "jobs.csv");
  if (!table) return table.error().sentence.empty() ? std::abort(), 0 : 0;
  std::string again = table_line(table->columns);
  for (const auto& row : table->rows) {
    if (row.size() != table->columns.size()) std::abort();
    again += table_line(row);
  }
  const auto same = parse_table(again, "again");
  // Lines whose first cell is a quoted comment or whose cells are quoted blanks are not kept.
  if (!same && !again.starts_with('#')) std::abort();
  return 0;
}
