#include <memory>
#include <string>
#include <vector>

#include "tools/commands/command.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {
namespace {

struct FiguresCommand {
  std::string folder = "figures";
  double seeds = 100;
  double scan_seeds = 20;
  bool overwrite = false;
};

int figures(const FiguresCommand& command) {
  const std::vector<ReportPart> parts = {
      {"Fig. 4", make_grating},
      {"Fig. 5", make_depth_profiles},
      {"Figs 6 and 7",
       [&](const ReportFolder& folder) {
         return make_centre_press(folder, static_cast<int>(command.seeds));
       }},
      {"Fig. 8",
       [&](const ReportFolder& folder) {
         return make_position_scan(folder, static_cast<int>(command.scan_seeds));
       }},
      {"contact laws", make_contact_laws},
      {"bars on a curved finger", make_curved_bars}};
  return make_report({.folder = command.folder, .overwrite = command.overwrite, .progress = {}},
                     "# The paper's figures, from this model\n\nMade by `merkel figures`.\n\n",
                     parts, "figures");
}

}  // namespace

void add_figures_command(CommandLine& program) {
  auto command = std::make_shared<FiguresCommand>();
  program
      .subcommand("figures",
                  "Computes the paper's Figs 4 to 8 from this model: tables (CSV), pictures (PNG) "
                  "and a report that compares them with the paper.",
                  "figures --out figures")
      .option("--out", command->folder, "Folder to write to")
      .option("--seeds", command->seeds, "Receptor draws for Figs 6 and 7", {1, 100000})
      .option("--scan-seeds", command->scan_seeds, "Receptor draws for Fig. 8", {1, 100000})
      .flag("--overwrite", command->overwrite, "Replace existing files")
      .runs([command] { return figures(*command); });
}

}  // namespace merkel
