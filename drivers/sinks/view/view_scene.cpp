#include "drivers/sinks/view/view_scene.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/contact/pressed_tip.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/units.hpp"
#include "drivers/sinks/json_line.hpp"
#include "drivers/sinks/session_position.hpp"
#include "drivers/sinks/view/view_frames.hpp"

namespace merkel {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxDrawnReceptors = 15'000;  ///< most receptors sent per patch
constexpr double kFinestTipPixel_mm = 0.1;          ///< of a tip's picture
constexpr double kMaxTipPixels = 160.0;             ///< along its longer side

/// Rounded to 0.01 mm, finer than a screen pixel.
double place(double mm) { return std::round(mm * 100.0) / 100.0; }

/// A patch, its receptors, and the centre of each afferent, by number.
Json json_of(const PatchParameters& parameters) {
  const PatchLayout layout = layout_of(parameters).value_or(PatchLayout{});
  const std::vector<Receptor>& receptors = layout.receptors;
  // Evenly thinned out if there are too many for a picture.
  const std::size_t stride = receptors.size() / kMaxDrawnReceptors + 1;
  Json dots = Json::array();
  for (std::size_t i = 0; i < receptors.size(); i += stride) {
    dots.push_back({place(receptors[i].x_mm), place(receptors[i].y_mm), receptors[i].neuron});
  }
  Json centres = Json::array();
  for (const AfferentSite& site : layout.afferents) {
    centres.push_back({place(site.x_mm), place(site.y_mm)});
  }
  const bool fields = parameters.layout == ReceptorLayout::kFields;
  return {{"name", parameters.name},
          {"length_mm", parameters.patch.length_mm},
          {"width_mm", parameters.patch.width_mm},
          {"columns", parameters.patch.columns},
          {"rows", parameters.patch.rows},
          {"field_radius_mm", fields ? parameters.field.radius_mm : 0.0},
          {"thinned", stride > 1},
          {"receptors", std::move(dots)},
          {"centres", std::move(centres)}};
}

Json json_of(const TaxelArray& array, double orientation_deg) {
  Json centres = Json::array();
  for (const Position& centre : array.centres()) {
    centres.push_back(Json::array({centre.x_mm, centre.y_mm}));
  }
  const bool disc = array.shape == TaxelArray::Shape::kDisc;
  return {
      {"centres", std::move(centres)},     {"disc", disc},
      {"width_mm", array.width_mm},        {"length_mm", disc ? array.width_mm : array.length_mm},
      {"x_mm", array.place.x_mm},          {"y_mm", array.place.y_mm},
      {"orientation_deg", orientation_deg}};
}

/// The heights of a tip, turned as it presses, in hundredths of a millimetre; -1: beyond its end.
/// Of a surface that repeats, one period.
Json json_of_heights(const Indenter& indenter, const SkinParameters& skin) {
  const SlidingSurface& surface = indenter.surface;
  auto [half_x, half_y] = half_extent(indenter);
  if (surface.period_x_mm > 0.0) half_x = 0.5 * surface.period_x_mm;
  if (surface.period_y_mm > 0.0) half_y = 0.5 * surface.period_y_mm;
  const double pixel_mm =
      std::max(kFinestTipPixel_mm, 2.0 * std::max(half_x, half_y) / kMaxTipPixels);
  const auto pixels = [&](double half) {
    return static_cast<std::size_t>(std::max(1.0, std::round(2.0 * half / pixel_mm)));
  };
  const std::size_t columns = pixels(half_x);
  const std::size_t rows = pixels(half_y);
  const auto middle = [](std::size_t at, std::size_t count, double half) {
    return half * (static_cast<double>(2 * at + 1) / static_cast<double>(count) - 1.0);
  };
  const TipHeight height = height_of(indenter, skin);
  Json heights = Json::array();
  for (std::size_t at = 0; at < columns * rows; ++at) {
    const double mm = std::min(height(middle(at % columns, columns, half_x),  //
                                      middle(at / columns, rows, half_y)),
                               surface.relief_mm);
    heights.push_back(std::isfinite(mm) ? std::lround(100.0 * mm) : -1);
  }
  return {{"columns", columns},
          {"width_mm", 2.0 * half_x},
          {"length_mm", 2.0 * half_y},
          {"repeats_x", surface.period_x_mm > 0.0},
          {"repeats_y", surface.period_y_mm > 0.0},
          {"heights", std::move(heights)}};
}

Json json_of(const Indenter& indenter, const SkinParameters& skin) {
  const bool force = indenter.control == Indenter::Control::kForce;
  Json json = {{"patch", indenter.patch}, {"control", force ? "force" : "depth"}};
  if (const SphereTip* const sphere = indenter.sphere()) {
    json["radius_mm"] = sphere->radius_mm;
  } else if (indenter.taxels() != nullptr) {
    json["taxels"] = json_of(*indenter.taxels(), indenter.orientation_deg);
  } else {
    json["shape"] = json_of_heights(indenter, skin);
  }
  return json;
}

Json json_of_counters() {
  Json counters = Json::array();
  const auto add = [&](std::string_view name, std::string_view unit, std::string_view meaning,
                       bool fault) {
    counters.push_back({{"name", name}, {"unit", unit}, {"meaning", meaning}, {"fault", fault}});
  };
  for (const auto& field : kRunCounterFields<>) {
    add(field.name, field.unit, field.meaning, field.fault);
  }
  add("page_lost", "", "spikes and points that this page did not receive", true);
  return counters;
}

Json json_of(const RunDescription& run) {
  const bool volts =
      std::visit([](const auto& afferent) { return afferent.kPotential; }, run.model.afferent);
  Json json = {{"scene", run.scene},
               {"tick_ms", units::ms_from(run.model.tick)},
               {"drive_unit", run.model.energy_driven() ? "Hz" : "\u00b5A/cm\u00b2"},
               {"potential_name", volts ? "potential" : "state"},
               {"potential_unit", volts ? "mV" : ""},
               {"counters", json_of_counters()}};
  for (const char* list : {"patches", "probes", "electrodes", "stops", "facts"}) {
    json[list] = Json::array();
  }
  for (const PatchParameters& patch : run.model.patches) json["patches"].push_back(json_of(patch));
  for (const Indenter& indenter : run.model.indenters) {
    json["probes"].push_back(json_of(indenter, run.model.skin));
  }
  for (const Electrode& electrode : run.encoding.electrodes) {
    json["electrodes"].push_back({{"name", electrode.name},
                                  {"amplitude_uA", electrode.amplitude_uA},
                                  {"frequency_Hz", electrode.frequency_Hz}});
  }
  for (auto stop = StimulationCommand::Stop::kNone; stop <= StimulationCommand::Stop::kLast;
       stop = static_cast<StimulationCommand::Stop>(static_cast<int>(stop) + 1)) {
    json["stops"].push_back(name_of(stop));
  }
  for (const auto& [name, value] : run.facts) json["facts"].push_back(Json::array({name, value}));
  return json;
}

}  // namespace

ViewScene::ViewScene(const SinkSetup& setup, bool steers) {
  Json json = json_of(setup.run);
  json["neurons"] = setup.neurons;
  json["control"] = false;
  if (setup.session) json["session"]["length_s"] = setup.session->length_s;
  viewing = json_line(json);
  if (!steers) return;
  json["control"] = true;
  steering = json_line(json);
}

}  // namespace merkel
