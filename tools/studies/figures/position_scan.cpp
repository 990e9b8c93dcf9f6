// Fig. 8: the rate of the network against the receptors of the pressed subregion.
#include <algorithm>
#include <numeric>
#include <vector>

#include "tools/filled_text.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/figures/rates.hpp"
#include "tools/studies/report/rank_correlation.hpp"

namespace merkel {

Expected<std::string, SetupError> make_position_scan(const ReportFolder& folder,
                                                     ReportTables& tables, int seeds) {
  CsvTable& table = tables.at("fig8_positions.csv");
  TactileModel::Parameters parameters = preset_scene("paper")->model;
  const Patch& patch = parameters.patches[0].patch;
  std::vector<double> correlations;
  for (int seed = 1; seed <= seeds; ++seed) {
    parameters.patches[0].receptors.seed = parameters.network.seed =
        static_cast<std::uint64_t>(seed);
    std::vector<double> receptors;
    std::vector<double> rates;
    for (std::uint32_t position = 1; position <= 20; ++position) {
      const ContactInput press{.depth_mm = 1.5,
                               .x_mm = patch.centre_x_mm(position),
                               .y_mm = patch.centre_y_mm(position)};
      const PressedPatch pressed = press_patch(parameters, press, 1.0);
      receptors.push_back(pressed.receptors[position - 1]);
      rates.push_back(std::accumulate(pressed.rate_hz.begin(), pressed.rate_hz.end(), 0.0));
      table.row({static_cast<double>(seed), static_cast<double>(position), receptors.back(),
                 rates.back()});
    }
    correlations.push_back(spearman(receptors, rates));
    folder.report(static_cast<double>(seed) / seeds);
  }
  const double mean = std::accumulate(correlations.begin(), correlations.end(), 0.0) /
                      static_cast<double>(correlations.size());
  const double least = *std::min_element(correlations.begin(), correlations.end());
  return filled_page(
      "figure_position_scan",
      {{"seeds", seeds}, {"mean", mean}, {"least", least}, {"reproduced", mean >= 0.95}});
}

}  // namespace merkel
