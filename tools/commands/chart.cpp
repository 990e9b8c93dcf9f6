#include "tools/studies/charts/chart.hpp"

#include <memory>
#include <string>
#include <vector>

#include "core/parameters/nearest_name.hpp"
#include "core/simd/simd_target.hpp"
#include "tools/commands/command.hpp"

namespace merkel {
namespace {

struct ChartCommand {
  std::string folder = "charts";
  std::string only;  ///< name of a part; empty: all
  bool overwrite = false;
};

int chart(const ChartCommand& command) {
  std::vector<ReportPart> parts = {{"integrators", make_integrators_chart},
                                   {"contact stage", make_contact_chart},
                                   {"contact solver", make_solved_contact_chart},
                                   {"contact stability", make_contact_stability_chart},
                                   {"end to end", make_end_to_end_chart},
                                   {"stability", make_stability_chart},
                                   {"touched area", make_touch_chart}};
  if (!command.only.empty()) {
    const std::string names = listed(parts, &ReportPart::name);
    std::erase_if(parts, [&](const ReportPart& part) { return part.name != command.only; });
    if (parts.empty()) return refuse("--only must be one of: " + names);
  }
  return make_report({.folder = command.folder, .overwrite = command.overwrite, .progress = {}},
                     "# Speed against accuracy\n\nMade by `merkel chart` on one core with " +
                         simd_target() + ".\n\n",
                     parts, "charts");
}

}  // namespace

void add_chart_command(CommandLine& program) {
  auto command = std::make_shared<ChartCommand>();
  program
      .subcommand("chart",
                  "Charts speed against accuracy on this machine, and where methods become "
                  "unstable: tables (CSV), pictures (PNG) and a report.",
                  "chart --out charts")
      .option("--out", command->folder, "Folder to write to")
      .option("--only", command->only, "Make only one part, for example \"contact solver\"")
      .flag("--overwrite", command->overwrite, "Replace existing files")
      .runs([command] { return chart(*command); });
}

}  // namespace merkel
