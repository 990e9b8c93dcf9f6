// Fig. 5: strain energy density against distance, for several depths.
#include <algorithm>
#include <vector>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/figures/rates.hpp"

namespace merkel {
namespace {

struct Peak {
  double at_mm = 0.0;
  double height_kPa = 0.0;
  double deepest_kPa = 0.0;  ///< energy density on the axis
  double printed_kPa = 0.0;  ///< the same by the printed formula
  int others = 0;            ///< further maxima at larger r, each after a minimum
};

}  // namespace

Expected<std::string, SetupError> make_depth_profiles(const ReportFolder& /*folder*/,
                                                      ReportTables& tables) {
  const SkinParameters skin;
  const SkinMaterial material(skin);
  CsvTable& table = tables.at("fig5_depth.csv");
  const auto profile = [&](double radius_mm, double depth_mm) {
    const HertzContact law(radius_mm, skin.radius_mm, material.reduced_modulus_kPa());
    const ContactState contact = law.at_depth(depth_mm);
    Peak peak;
    peak.printed_kPa =
        energy_density_kPa(point_load_stress(contact.force_mN, skin.poisson_ratio, 0.0, depth_mm),
                           material, skin.energy_density);
    std::vector<double> along;
    for (int i = 0; i <= 1000; ++i) {
      const double r = 0.01 * i;
      const double energy =
          energy_density_kPa(huber_stress(contact, skin.poisson_ratio, r, skin.receptor_depth_mm),
                             material, skin.energy_density);
      table.row({radius_mm, depth_mm, r, energy});
      along.push_back(energy);
      if (energy <= peak.height_kPa) continue;
      peak.at_mm = r;
      peak.height_kPa = energy;
    }
    peak.deepest_kPa = along.front();
    for (std::size_t i = 1; i + 1 < along.size(); ++i) {
      const bool outside = 0.01 * static_cast<double>(i) > peak.at_mm;
      peak.others += outside && along[i] > along[i - 1] && along[i] >= along[i + 1] ? 1 : 0;
    }
    return peak;
  };
  Json rows = Json::array();
  std::vector<Peak> peaks;
  for (const auto& [radius, depth] :
       {std::pair{5.0, 1.0}, {5.0, 2.0}, {5.0, 3.0}, {5.0, 4.0}, {5.0, 5.0}, {2.0, 1.0}}) {
    peaks.push_back(profile(radius, depth));
    const Peak& peak = peaks.back();
    rows.push_back({{"radius", radius},
                    {"depth", depth},
                    {"height", peak.height_kPa},
                    {"at", peak.at_mm},
                    {"deepest", peak.deepest_kPa},
                    {"printed", peak.printed_kPa}});
  }
  const bool grows =
      std::is_sorted(peaks.begin(), peaks.begin() + 5,
                     [](const Peak& a, const Peak& b) { return a.height_kPa < b.height_kPa; });
  const bool turns = peaks[0].at_mm == 0.0 && peaks[1].at_mm > 0.0;
  const auto falls = [&](double Peak::*value) {
    return std::is_sorted(peaks.begin(), peaks.begin() + 5,
                          [value](const Peak& a, const Peak& b) { return a.*value > b.*value; });
  };
  const bool second = std::any_of(peaks.begin(), peaks.begin() + 5,
                                  [](const Peak& peak) { return peak.others > 0; });
  return filled_page("figure_depth_profiles",
                     {{"peaks", std::move(rows)},
                      {"grows", grows},
                      {"turns", turns},
                      {"smaller", peaks[5].height_kPa > peaks[0].height_kPa},
                      {"deepest_falls", falls(&Peak::deepest_kPa)},
                      {"printed_falls", falls(&Peak::printed_kPa)},
                      {"second", second}});
}

}  // namespace merkel
