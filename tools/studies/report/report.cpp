#include "tools/studies/report/report.hpp"

#include <cstdio>
#include <filesystem>
#include <utility>

#include <unistd.h>

#include "drivers/files/output_file.hpp"
#include "tools/exit_code.hpp"
#include "tools/studies/report/plot_runner.hpp"

namespace merkel {

namespace {

Expected<std::string, SetupError> made(const ReportPart& part, const ReportFolder& folder) {
  ReportTables tables;
  for (const auto& [name, columns] : part.tables) {
    auto table = CsvTable::create(folder.path(name), columns, folder.overwrite);
    if (!table) return Unexpected<SetupError>(table.error());
    tables.emplace(name, std::move(*table));
  }
  auto text = part.make(folder, tables);
  for (auto& [name, table] : tables) {
    if (!text) break;
    if (auto closed = table.close(); !closed) return Unexpected<SetupError>(closed.error());
  }
  return text;
}

/// The heading and the text of all parts.
Expected<std::string, SetupError> text_of(const std::string& heading,
                                          std::span<const ReportPart> parts, ReportFolder folder) {
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  std::string text = heading;
  for (const ReportPart& part : parts) {
    if (terminal) {
      folder.progress = [&part](double fraction) {
        std::fprintf(stderr, "\r%s: %3.0f %% ", part.name, 100.0 * fraction);
      };
    }
    auto done = made(part, folder);
    if (terminal) std::fprintf(stderr, "\r%s: done   \n", part.name);
    if (!done) {
      // What is known so far: a heading alone is nothing.
      if (text.size() > heading.size()) std::fputs(text.c_str(), stdout);
      return done;
    }
    text += *done;
  }
  return text;
}

}  // namespace

int make_report(const ReportFolder& folder, const std::string& heading,
                std::span<const ReportPart> parts, const std::string& plot_script) {
  std::error_code error;
  std::filesystem::create_directories(folder.folder, error);
  if (error) return refuse("cannot make the folder " + folder.folder + ": " + error.message());
  auto report = OutputFile::create(folder.path(folder.file), folder.overwrite);
  if (!report) return refuse(report.error());
  const auto text = text_of(heading, parts, folder);
  if (!text) return refuse(text.error());
  if (!report->write(*text) || !report->close()) return fail(report->error());
  std::fputs(text->c_str(), stdout);
  if (auto drawn = draw_plots(plot_script, folder.folder); !drawn) {
    return fail(drawn.error().sentence);
  }
  return kDone;
}

int print_report(const std::string& heading, std::span<const ReportPart> parts) {
  const auto text = text_of(heading, parts, {});
  if (!text) return refuse(text.error());
  std::fputs(text->c_str(), stdout);
  return kDone;
}

}  // namespace merkel
