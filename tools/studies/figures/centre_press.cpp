// Figs 6 and 7: rates of the 20 afferents under a press at the centre, against the distance and
// number of their receptors.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <fmt/core.h>

#include "tools/filled_text.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/figures/figure.hpp"
#include "tools/studies/figures/rates.hpp"
#include "tools/studies/report/rank_correlation.hpp"

namespace merkel {
namespace {

constexpr ContactInput kPress{.depth_mm = 1.5, .force_mN = 0.0, .x_mm = 15.0, .y_mm = 10.0};
constexpr double kDuration_s = 1.0;

double percentile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

/// Mean and 5th to 95th percentile.
std::string spread(const std::vector<double>& values) {
  const double mean =
      std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  return fmt::format("{:.2f} ({:.2f} … {:.2f})", mean, percentile(values, 0.05),
                     percentile(values, 0.95));
}

struct Statistics {
  std::vector<double> with_distance;
  std::vector<double> with_count;
  int neuron_13_highest = 0;
  int far_above_near = 0;
  int far_has_more = 0;

  /// True if rates fall with distance and rise with the receptor count in nine of ten draws.
  [[nodiscard]] bool joint() const {
    return percentile(with_distance, 0.95) < 0.0 && percentile(with_count, 0.05) > 0.0;
  }
  void add(const PressedPatch& patch) {
    with_distance.push_back(
        partial_spearman(patch.rate_hz, patch.mean_distance_mm, patch.receptors));
    with_count.push_back(partial_spearman(patch.rate_hz, patch.receptors, patch.mean_distance_mm));
    const std::vector<double>& rate = patch.rate_hz;
    const double highest = *std::max_element(rate.begin(), rate.end());
    neuron_13_highest += rate[12] == highest && rate[12] > rate[7] ? 1 : 0;
    const bool more = patch.receptors[17] > patch.receptors[7];
    far_has_more += more ? 1 : 0;
    far_above_near += more && rate[17] > rate[7] ? 1 : 0;
  }
};

}  // namespace

Expected<std::string, SetupError> make_centre_press(const ReportFolder& folder,
                                                    ReportTables& tables, int seeds) {
  CsvTable& rates = tables.at("fig6_centre_press.csv");
  CsvTable& draws = tables.at("fig7_draws.csv");

  Json facts = {{"seeds", seeds}};
  const std::vector<std::string> sets = {"paper", "paper-wide"};
  for (std::size_t set = 0; set < sets.size(); ++set) {
    TactileModel::Parameters parameters = preset_scene(sets[set])->model;
    Statistics statistics;
    for (int seed = 1; seed <= seeds; ++seed) {
      folder.report((static_cast<double>(set) + static_cast<double>(seed) / seeds) /
                    static_cast<double>(sets.size()));
      parameters.patches[0].receptors.seed = parameters.network.seed =
          static_cast<std::uint64_t>(seed);
      const PressedPatch patch = press_patch(parameters, kPress, kDuration_s);
      statistics.add(patch);
      for (std::size_t n = 0; n < patch.rate_hz.size(); ++n) {
        const auto neuron = static_cast<double>(n + 1);
        if (seed == 1) {
          rates.row({sets[set]},
                    {neuron, patch.receptors[n], patch.mean_distance_mm[n], patch.rate_hz[n]});
        }
        draws.row({sets[set]}, {static_cast<double>(seed), neuron, patch.receptors[n],
                                patch.mean_distance_mm[n], patch.rate_hz[n]});
      }
    }
    facts["sets"].push_back({{"name", sets[set]},
                             {"distance", spread(statistics.with_distance)},
                             {"count", spread(statistics.with_count)},
                             {"joint", statistics.joint()},
                             {"highest", statistics.neuron_13_highest},
                             {"above", statistics.far_above_near},
                             {"more", statistics.far_has_more}});
  }
  return filled_page("figure_centre_press", facts);
}

}  // namespace merkel
