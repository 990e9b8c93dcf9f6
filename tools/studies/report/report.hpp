#pragma once

#include <functional>
#include <span>
#include <string>

#include "core/expected.hpp"

namespace merkel {

/// The folder of a report's tables, and its progress callback.
struct ReportFolder {
  std::string folder;
  std::string file = "report.md";  ///< for the text
  bool overwrite = false;
  std::function<void(double)>
      progress;  ///< called with the completed fraction of a part; may be empty

  void report(double fraction) const {
    if (progress) progress(fraction);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return folder + "/" + name; }
};

/// A part of a report: writes its tables to the folder and returns its text (Markdown).
struct ReportPart {
  const char* name;
  std::function<Expected<std::string, SetupError>(const ReportFolder&)> make;
};
/// Makes all parts, writes the text to the folder's file, prints it, and draws the tables with a
/// plot script. \param heading  start of the text. Returns the program's exit code.
int make_report(const ReportFolder& folder, const std::string& heading,
                std::span<const ReportPart> parts, const std::string& plot_script);

/// Prints parts that write no tables, without a folder. Returns the program's exit code.
int print_report(const std::string& heading, std::span<const ReportPart> parts);

}  // namespace merkel
