#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "tools/studies/report/csv_table.hpp"

namespace merkel {

/// The folder of a report's tables, and its progress callback.
struct ReportFolder {
  std::string folder;
  std::string file = "report.md";  ///< for the text
  bool overwrite = false;
  std::function<void(double)> progress =
      {};  ///< called with the completed fraction of a part; may be empty

  void report(double fraction) const {
    if (progress) progress(fraction);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return folder + "/" + name; }
};

/// The names of tables and their columns.
using TableHeads = std::vector<std::pair<const char*, const char*>>;
/// The tables of a part, by name. They are created before it is made, and closed after it.
using ReportTables = std::map<std::string, CsvTable>;

/// Fills the tables of a part and returns its text (Markdown).
using MakePart = Expected<std::string, SetupError>(const ReportFolder& folder,
                                                   ReportTables& tables);

/// A part of a report.
struct ReportPart {
  const char* name;
  TableHeads tables;
  std::function<MakePart> make;
};

/// Makes all parts, writes the text to the folder's file, prints it, and draws the tables with a
/// plot script. \param heading  start of the text. Returns the program's exit code.
int make_report(const ReportFolder& folder, const std::string& heading,
                std::span<const ReportPart> parts, const std::string& plot_script);

/// Prints parts that write no tables, without a folder. Returns the program's exit code.
int print_report(const std::string& heading, std::span<const ReportPart> parts);

}  // namespace merkel
