#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include <unistd.h>

#include "drivers/files/output_file.hpp"
#include "tools/commands/command.hpp"
#include "tools/figures/figure.hpp"
#include "tools/plot_runner.hpp"

namespace merkel {
namespace {

struct FiguresCommand {
  std::string folder = "figures";
  double seeds = 100;
  double scan_seeds = 20;
  bool overwrite = false;
};

struct Figure {
  const char* name;
  Expected<std::string, SetupError> (*make)(const FigureOptions&);
};

constexpr Figure kFigures[] = {{"Fig. 4", make_grating},
                               {"Fig. 5", make_depth_profiles},
                               {"Figs 6 and 7", make_centre_press},
                               {"Fig. 8", make_position_scan},
                               {"contact laws", make_contact_laws}};

int figures(const FiguresCommand& command) {
  std::error_code error;
  std::filesystem::create_directories(command.folder, error);
  if (error) return refuse("cannot make the folder " + command.folder + ": " + error.message());
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  FigureOptions options{.folder = command.folder,
                        .overwrite = command.overwrite,
                        .seeds = static_cast<int>(command.seeds),
                        .scan_seeds = static_cast<int>(command.scan_seeds),
                        .progress = {}};
  auto report = OutputFile::create(options.path("report.md"), command.overwrite);
  if (!report) return refuse(report.error());
  std::string text = "# The paper's figures, from this model\n\nMade by `merkel figures`.\n\n";
  for (const Figure& figure : kFigures) {
    if (terminal) {
      options.progress = [&figure](double fraction) {
        std::fprintf(stderr, "\r%s: %3.0f %% ", figure.name, 100.0 * fraction);
      };
    }
    const auto part = figure.make(options);
    if (terminal) std::fprintf(stderr, "\r%s: done   \n", figure.name);
    if (!part) return refuse(part.error());
    text += *part;
  }
  if (!report->write(text) || !report->close()) return fail(report->error());
  std::fputs(text.c_str(), stdout);
  if (auto drawn = draw_plots("figures", command.folder); !drawn) {
    return fail(drawn.error().sentence);
  }
  return kDone;
}

}  // namespace

void add_figures_command(CommandLine& program) {
  auto command = std::make_shared<FiguresCommand>();
  program
      .subcommand("figures",
                  "Computes the paper's Figs 4 to 8 from this model: tables (CSV), pictures (PNG) "
                  "and a report of what reproduces.",
                  "figures --out figures")
      .option("--out", command->folder, "Folder to write to")
      .option("--seeds", command->seeds, "Receptor draws for Figs 6 and 7", {1, 100000})
      .option("--scan-seeds", command->scan_seeds, "Receptor draws for Fig. 8", {1, 100000})
      .flag("--overwrite", command->overwrite, "Replace files that exist")
      .runs([command] { return figures(*command); });
}

}  // namespace merkel
