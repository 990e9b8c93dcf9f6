// Force against depth for all contact laws.
#include <fmt/core.h>

#include "core/contact/sphere_law.hpp"
#include "core/contact/tip_field.hpp"
#include "core/units.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/figures/rates.hpp"

namespace merkel {

Expected<std::string, SetupError> make_contact_laws(const ReportFolder& /*folder*/,
                                                    ReportTables& tables) {
  constexpr double kThickness_mm = 4.0;
  CsvTable& table = tables.at("contact_laws.csv");
  std::string report = filled_page("figure_contact_laws");
  for (const double radius : {2.0, 5.0}) {
    const SphereLaw hertz({}, radius);
    const TipField sphere({.tip = SphereTip{radius}}, {.contact_law = ContactLaw::kSneddon});
    const TipField layer({.tip = SphereTip{radius}}, {.thickness_mm = kThickness_mm});
    for (int i = 0; i <= 40; ++i) {
      const double depth = 0.05 * i;
      const double base = hertz.at_depth(depth).force_mN;
      table.row({radius, depth, units::N_from_mN(base), units::N_from_mN(sphere.force_mN(depth)),
                 units::N_from_mN(layer.force_mN(depth))});
      if (i == 10 || i == 20 || i == 30) {
        const double a = hertz.at_depth(depth).contact_radius_mm;
        report += fmt::format("| {:g} | {:g} | {:.2f} | {:.2f} | {:.3f} | {:.3f} |\n", radius,
                              depth, a / radius, a / kThickness_mm, sphere.force_mN(depth) / base,
                              layer.force_mN(depth) / base);
      }
    }
  }
  return report + "\n";
}

}  // namespace merkel
