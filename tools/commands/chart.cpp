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
  std::vector<ReportPart> parts = {
      {"integrators",
       {{"integrators.csv",
         "method,precision,step_us,cost_us_per_neuron_second,rms_error_ms,share_unmatched"}},
       make_integrators_chart},
      {"contact stage",
       {{"contact_stage.csv",
         "method,parameter,cost_us_per_tick,error_uA_per_cm2,afferents_reached"}},
       make_contact_chart},
      {"contact solver",
       {{"solved_contact.csv",
         "tip,pixels_across,force_error,energy_error,cold_iterations,cold_ms,warm_iterations,"
         "warm_ms"}},
       make_solved_contact_chart},
      {"contact stability",
       {{"contact_stability.csv", "case,setting,iterations,converged,force_error"},
        {"fast_slides.csv", "speed_mm_per_s,poor_share,force_error,energy_error"}},
       make_contact_stability_chart},
      {"end to end",
       {{"end_to_end.csv",
         "press,variant,step_us,cost_us_per_tick,rms_error_ms,median_error_ms,share_unmatched,"
         "spikes,reference_spikes"}},
       make_end_to_end_chart},
      {"stability",
       {{"stability.csv", "method,step_us,current_uA_per_cm2,gain_mS_per_cm2,outcome"}},
       make_stability_chart},
      {"touched area",
       {{"touch.csv",
         "receptors,afferents,depth_mm,contact_area_mm2,afferents_reached,active_afferents,"
         "cost_us_per_tick"}},
       make_touch_chart}};
  if (!command.only.empty()) {
    const std::string names = listed(parts, &ReportPart::name);
    std::erase_if(parts, [&](const ReportPart& part) { return part.name != command.only; });
    if (parts.empty()) return refuse("--only must be one of: " + names);
  }
  return make_report({.folder = command.folder, .overwrite = command.overwrite},
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
