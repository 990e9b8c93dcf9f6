#include "tools/run/touch_summary.hpp"

#include <algorithm>
#include <numbers>

#include "core/contact/contact_validity.hpp"
#include "core/parameters/nearest_name.hpp"
#include "core/units.hpp"
#include "drivers/probes/fused_probe.hpp"
#include "drivers/uri.hpp"
#include "tools/run/force_and_depth.hpp"
#include "tools/scene/contact_sentence.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

double area_mm2(const ContactState& contact) {
  return std::numbers::pi * contact.contact_radius_mm * contact.contact_radius_mm;
}

/// Whether a press is one of those to which the afferents of a preset are fitted.
Json fit_json(const Press& press, const TactileModel& model, const Indenter& tip,
              std::string_view preset) {
  const auto fitted_N = fitted_forces_N(preset);
  if (!fitted_N || tip.taxels() != nullptr) return {};
  const double force_N = units::N_from_mN(press.contact.force_mN);
  return {{"from_N", (*fitted_N)[0]},
          {"to_N", (*fitted_N)[1]},
          {"within", force_N >= (*fitted_N)[0] && force_N <= (*fitted_N)[1]},
          {"sphere", tip.sphere() != nullptr},
          {"same_skin", model.parameters().skin == preset_scene(preset)->model.skin}};
}

/// Where the readings of a probe come from. \param calibration  of the scene
std::string source_of(const std::string& text, std::string calibration) {
  if (text.starts_with("sim:")) return "simulated";
  const bool recorded = text.starts_with("replay:");
  // Each member of a fused probe may have its own.
  std::string of_members;
  for (const std::string_view member : FusedProbe::members_of(text)) {
    const auto uri = Uri::parse(member);
    if (!uri || !uri->options.contains("calibration")) continue;
    of_members += (of_members.empty() ? "" : " and ") + uri->options.at("calibration");
  }
  if (!of_members.empty()) calibration = of_members;
  if (!calibration.empty())
    return (recorded ? "recorded, calibrated by " : "calibrated by ") + calibration;
  return recorded ? "recorded" : "as its device reports it, not calibrated here";
}

}  // namespace

Json drift_json(const ContactDecision::Drift& drift) {
  const double time_s = units::s_from(drift.last - drift.first);
  if (!(time_s > 0.0)) return {};
  return {{"change_mN", drift.change_mN()},
          {"time_s", time_s},
          {"mN_per_s", drift.change_mN() / time_s},
          {"followed", drift.followed}};
}

std::string name_of_probe(const TactileModel& model, std::size_t probe) {
  const TactileModel::Parameters& scene = model.parameters();
  if (scene.indenters.size() == 1) return {};
  const std::string& patch = scene.patches[scene.indenters[probe].patch].name;
  const auto on_patch = std::count_if(
      scene.indenters.begin(), scene.indenters.end(),
      [&](const Indenter& each) { return each.patch == scene.indenters[probe].patch; });
  const std::string number = "probe " + std::to_string(probe + 1);
  if (patch.empty()) return number;
  return on_patch == 1 ? patch : patch + ", " + number;
}

Json press_json(const TactileModel& model, std::size_t probe, std::string_view preset) {
  const Press& press = model.deepest()[probe];
  const Indenter& tip = model.parameters().indenters[probe];
  const bool round = press.contact.touching() && tip.sphere() != nullptr;
  const ContactValidity validity =
      round ? validity_of(press.contact, model.parameters().skin, tip.sphere()->radius_mm)
            : ContactValidity{};
  const auto if_true = [](bool exists, double value) { return exists ? Json(value) : Json(); };
  return {{"touched", press.touching()},
          {"array", tip.taxels() != nullptr},
          {"driven_by", tip.control == Indenter::Control::kForce ? "force" : "depth"},
          {"fit", fit_json(press, model, tip, preset)},
          {"depth_mm", press.contact.depth_mm},
          {"x_mm", press.x_mm},
          {"y_mm", press.y_mm},
          {"contact_radius_mm", if_true(round, press.contact.contact_radius_mm)},
          {"contact_area_mm2", if_true(press.contact.touching(), area_mm2(press.contact))},
          {"force_N", units::N_from_mN(press.contact.force_mN)},
          {"peak_pressure_kPa", if_true(press.contact.touching(), press.contact.peak_pressure_kPa)},
          {"radius_ratio", if_true(round, validity.radius_ratio)},
          {"sphere_force_error", if_true(round, validity.sphere_force_error)},
          {"layer_ratio", if_true(round, validity.layer_ratio)},
          {"layer_force_error", if_true(round, validity.layer_force_error)},
          {"valid", round ? Json(validity.within) : Json()},
          {"validity", press.touching() ? Json(contact_sentence(press, model, probe)) : Json()}};
}

Json validity_json(const Scene& scene, const TactileModel& model, const RunReport* report) {
  Json entries = Json::array();
  for (std::size_t i = 0; i < model.indenters(); ++i) {
    const Json press = press_json(model, i, scene.preset);
    if (press["touched"] == false) continue;
    const Json entry = {{"driven_by", press["driven_by"]},
                        {"source", source_of(scene.uri_of(i), scene.probes[i].calibration)},
                        {"drift", report != nullptr ? drift_json(report->probes[i].drift) : Json()},
                        {"fit", press["fit"]},
                        {"skin_law", press["validity"]}};
    const auto same = std::find_if(entries.begin(), entries.end(), [&](Json other) {
      other.erase("probes");
      return other == entry;
    });
    if (same == entries.end()) {
      entries.push_back(entry);
      entries.back()["probes"] = Json::array({name_of_probe(model, i)});
    } else {
      (*same)["probes"].push_back(name_of_probe(model, i));
    }
  }
  // Names, unless one entry stands for all.
  for (Json& entry : entries) {
    const std::string name =
        listed(entry["probes"], [](const Json& probe) { return probe.get<std::string>(); });
    entry["name"] = entries.size() > 1 ? name : "";
  }
  return entries;
}

Json both_json(const RunReport& report, const TactileModel& model, std::size_t probe) {
  const auto both = force_and_depth(report.probes[probe], model, probe);
  if (!both) return {};
  return {{"force_N", both->force_N},
          {"depth_mm", both->depth_mm},
          {"model_force_N", both->model_force_N},
          {"ratio", both->ratio()}};
}

}  // namespace merkel
