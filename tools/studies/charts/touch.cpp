// Chart 5: cost of a tick against the touched area.
#include <numbers>
#include <vector>

#include <fmt/core.h>

#include "core/scene/tactile_patch.hpp"
#include "core/units.hpp"
#include "tools/filled_text.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/bench/measure.hpp"
#include "tools/studies/charts/chart.hpp"

namespace merkel {
namespace {

struct Skin {
  std::int64_t receptors;
  Patch patch;
};
const Skin kSkins[] = {
    {450, {}},
    {5000, {.length_mm = 30.0, .width_mm = 20.0, .columns = 15, .rows = 12}},
    {120'000, {.length_mm = 100.0, .width_mm = 80.0, .columns = 68, .rows = 63}}};

}  // namespace

Expected<std::string, SetupError> make_touch_chart(const ReportFolder& folder,
                                                   ReportTables& tables) {
  CsvTable& table = tables.at("touch.csv");
  std::string text = filled_page("chart_touch");
  for (const Skin& skin : kSkins) {
    TactileModel::Parameters parameters = preset_scene("paper")->model;
    parameters.patches[0].patch = skin.patch;
    parameters.patches[0].receptors.count = skin.receptors;
    parameters.network.gain = 0.0;
    parameters.indenters[0].tip = SphereTip{5.0};
    // An equal current per receptor would silence large patches and block small ones.
    parameters.transduction.alpha_uA_per_cm2 =
        22.5 * skin.patch.subregions() / static_cast<double>(skin.receptors);
    TactileModel model = *TactileModel::create(parameters);
    for (const double depth_mm : {0.0, 0.01, 0.1, 0.3, 1.0, 2.0, 3.0}) {
      model.reset();
      ContactInput input{.depth_mm = depth_mm,
                         .x_mm = 0.5 * skin.patch.length_mm,
                         .y_mm = 0.5 * skin.patch.width_mm};
      std::chrono::nanoseconds time{0};
      const auto tick = [&] {
        // A probe is never completely still.
        input.depth_mm = depth_mm * ((time / parameters.tick) % 2 == 0 ? 1.0 : 1.0 - 1e-6);
        model.step({&input, 1}, time);
        time += parameters.tick;
      };
      for (int k = 0; k < 300; ++k) tick();
      const double cost_us = 1e6 * measure(tick, 5).median_s;
      const TactilePatch& patch = model.patches()[0];
      const std::size_t active = patch.active_neurons();
      const double a = model.press(0, input).contact.contact_radius_mm;
      const double area = std::numbers::pi * a * a;
      const std::size_t reached = depth_mm > 0.0 ? patch.drive().afferents_reached() : 0;
      table.row({static_cast<double>(skin.receptors), static_cast<double>(patch.neurons()),
                 depth_mm, area, static_cast<double>(reached), static_cast<double>(active),
                 cost_us});
      text += fmt::format("| {} | {} | {:g} | {:.1f} | {} | {} | {:.2f} |\n",
                          static_cast<long long>(skin.receptors), patch.neurons(), depth_mm, area,
                          reached, active, cost_us);
    }
    folder.report((static_cast<double>(&skin - kSkins) + 1.0) / std::size(kSkins));
  }
  return text + "\n";
}

}  // namespace merkel
