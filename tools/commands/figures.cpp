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
      {"Fig. 4",
       {{"fig4_grating.csv", "x_mm,sed_kPa,current_uA_per_cm2,rate_hz,pressed"}},
       make_grating},
      {"Fig. 5", {{"fig5_depth.csv", "radius_mm,depth_mm,r_mm,sed_kPa"}}, make_depth_profiles},
      {"Figs 6 and 7",
       {{"fig6_centre_press.csv", "set,neuron,receptors,mean_distance_mm,rate_hz"},
        {"fig7_draws.csv", "set,seed,neuron,receptors,mean_distance_mm,rate_hz"}},
       [&](const ReportFolder& folder, ReportTables& tables) {
         return make_centre_press(folder, tables, static_cast<int>(command.seeds));
       }},
      {"Fig. 8",
       {{"fig8_positions.csv", "seed,position,receptors,network_rate_hz"}},
       [&](const ReportFolder& folder, ReportTables& tables) {
         return make_position_scan(folder, tables, static_cast<int>(command.scan_seeds));
       }},
      {"contact laws",
       {{"contact_laws.csv", "radius_mm,depth_mm,hertz_N,exact_sphere_N,layer_N"}},
       make_contact_laws},
      {"bars on a curved finger",
       {{"curved_bars.csv",
         "width_mm,depth_mm,force_N,elements_force_N,middle_kPa,elements_middle_kPa,edge_kPa,"
         "elements_edge_kPa"}},
       make_curved_bars}};
  return make_report({.folder = command.folder, .overwrite = command.overwrite},
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
