// Force against depth for all contact laws.
#include <fmt/core.h>

#include "core/contact/sphere_law.hpp"
#include "core/contact/tip_field.hpp"
#include "core/units.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/figures/rates.hpp"
#include "tools/studies/report/csv_table.hpp"

namespace merkel {

Expected<std::string, SetupError> make_contact_laws(const ReportFolder& options) {
  constexpr double kThickness_mm = 4.0;
  auto table = CsvTable::create(
      options.path("contact_laws.csv"),
      "radius_mm,depth_mm,hertz_N,sneddon_N,layer_dimitriadis_N,layer_exact_N", options.overwrite);
  if (!table) return Unexpected<SetupError>(table.error());
  std::string report =
      "## Contact laws\n\nForce against depth of a sphere on a half-space (Hertz; Sneddon's exact "
      "sphere) and on skin of 4 mm bonded to bone (Dimitriadis' polynomial; the exact layer) "
      "(`contact_laws.csv`).\n\n| R (mm) | depth (mm) | a/R | √(Rd)/h | Sneddon/Hertz | "
      "Dimitriadis/Hertz | exact layer/Hertz |\n|---|---|---|---|---|---|---|\n";
  for (const double radius : {2.0, 5.0}) {
    const SphereLaw hertz({}, radius);
    const SphereLaw sneddon({.contact_law = ContactLaw::kSneddon}, radius);
    const SphereLaw polynomial({.thickness_mm = kThickness_mm}, radius);
    const TipField solved({.radius_mm = radius},
                          {.thickness_mm = kThickness_mm, .layer_law = LayerLaw::kExact});
    for (int i = 0; i <= 40; ++i) {
      const double depth = 0.05 * i;
      const double base = hertz.at_depth(depth).force_mN;
      table->row({radius, depth, units::N_from_mN(base),
                  units::N_from_mN(sneddon.at_depth(depth).force_mN),
                  units::N_from_mN(polynomial.at_depth(depth).force_mN),
                  units::N_from_mN(solved.force_mN(depth))});
      if (i == 10 || i == 20 || i == 30) {
        const double a = hertz.at_depth(depth).contact_radius_mm;
        report += fmt::format(
            "| {:g} | {:g} | {:.2f} | {:.2f} | {:.3f} | {:.3f} | {:.3f} |\n", radius, depth,
            a / radius, a / kThickness_mm, sneddon.at_depth(depth).force_mN / base,
            polynomial.at_depth(depth).force_mN / base, solved.force_mN(depth) / base);
      }
    }
  }
  if (auto closed = table->close(); !closed) return Unexpected<SetupError>(closed.error());
  return report + "\n";
}

}  // namespace merkel
