// Bars on a curved finger: the model's contact against boundary elements.
#include <fmt/core.h>

#include "core/contact/tip_field.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/reference/flat_tip_boundary_elements.hpp"

namespace merkel {

Expected<std::string, SetupError> make_curved_bars(const ReportFolder& /*folder*/,
                                                   ReportTables& tables) {
  CsvTable& table = tables.at("curved_bars.csv");
  const SkinParameters skin{.radius_mm = 7.0};
  const SkinMaterial material(skin);
  std::string report = filled_page("figure_curved_bars");
  for (const double width : {1.0, 3.0}) {
    const BarTip bar{.widths_mm = {width}, .gaps_mm = {}, .length_mm = 20.0};
    const Indenter tip{.tip = bar};
    const TipField field(tip, skin);
    for (const double depth : {0.3, 0.7, 1.5}) {
      const reference::FlatTipBoundaryElements elements(
          {.reduced_modulus_kPa = material.reduced_modulus_kPa(),
           .poisson_ratio = skin.poisson_ratio,
           .width_mm = width,
           .length_mm = bar.length_mm,
           .skin_radius_mm = skin.radius_mm,
           .skin_radius_along_mm = skin.finger_along_mm(),
           .depth_mm = depth});
      const auto energy = [&](const CartesianStress& stress) {
        return energy_density_kPa(stress, material, EnergyDensity::kDistortional);
      };
      const auto ours = [&](double x) { return energy(field.at(x, 0.0, depth).stress); };
      const auto theirs = [&](double x) {
        return energy(elements.stress(x, 0.0, skin.receptor_depth_mm));
      };
      const double edge = 0.5 * width;
      table.row({width, depth, units::N_from_mN(field.force_mN(depth)),
                 units::N_from_mN(elements.force_mN()), ours(0.0), theirs(0.0), ours(edge),
                 theirs(edge)});
      report += fmt::format("| {:g} | {:g} | {:+.1f} % | {:+.1f} % | {:+.1f} % |\n", width, depth,
                            100.0 * (field.force_mN(depth) / elements.force_mN() - 1.0),
                            100.0 * (ours(0.0) / theirs(0.0) - 1.0),
                            100.0 * (ours(edge) / theirs(edge) - 1.0));
    }
  }
  return report + "\n";
}

}  // namespace merkel
