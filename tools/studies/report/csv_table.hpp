#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "core/expected.hpp"
#include "drivers/files/output_file.hpp"

namespace merkel {

/// Writes a CSV table, row by row.
class CsvTable {
 public:
  [[nodiscard]] static Expected<CsvTable, SetupError> create(const std::string& path,
                                                             const std::string& header,
                                                             bool overwrite);
  /// Appends a row; its numbers read back to the same doubles.
  void row(std::initializer_list<double> values);
  /// Appends a row that starts with text fields.
  void row(std::initializer_list<std::string_view> texts, std::initializer_list<double> values);
  [[nodiscard]] Expected<void, SetupError> close();

 private:
  explicit CsvTable(OutputFile file) : file_(std::move(file)) {}
  OutputFile file_;
};

}  // namespace merkel
