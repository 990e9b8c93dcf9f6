#include "tools/run/touch_summary.hpp"

#include <algorithm>
#include <numbers>

#include <fmt/core.h>

#include "core/contact/contact_validity.hpp"
#include "core/units.hpp"
#include "tools/run/force_and_depth.hpp"
#include "tools/scene/contact_sentence.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

double area_mm2(const ContactState& contact) {
  return std::numbers::pi * contact.contact_radius_mm * contact.contact_radius_mm;
}

/// "thumb" if patches have names, else "probe 2"; empty if it is the only one.
std::string name_of_probe(const TactileModel& model, std::size_t probe) {
  const TactileModel::Parameters& scene = model.parameters();
  if (scene.indenters.size() == 1) return {};
  const std::string& patch = scene.patches[scene.indenters[probe].patch].name;
  const auto on_patch = std::count_if(
      scene.indenters.begin(), scene.indenters.end(),
      [&](const Indenter& each) { return each.patch == scene.indenters[probe].patch; });
  const std::string number = "probe " + std::to_string(probe + 1);
  if (patch.empty()) return number + ": ";
  return on_patch == 1 ? patch + ": " : patch + ", " + number + ": ";
}

/// What drove the model, and whether its afferents are fitted to such a press.
std::string drive_text(const Press& press, const Indenter& tip, std::string_view preset) {
  const bool force = tip.control == Indenter::Control::kForce;
  std::string text = force ? "\n  driven by its force" : "\n  driven by its depth";
  const auto fitted_N = fitted_forces_N(preset);
  if (!fitted_N || tip.taxels() != nullptr) return text + "\n";
  const double force_N = units::N_from_mN(press.contact.force_mN);
  const bool within = force_N >= (*fitted_N)[0] && force_N <= (*fitted_N)[1];
  return text + fmt::format("; the afferents are fitted to spheres pressed with {:g} to {:g} N{}\n",
                            (*fitted_N)[0], (*fitted_N)[1],
                            within ? "" : ": beyond, their rates are an extrapolation");
}

}  // namespace

std::string touch_text(const RunReport& report, const TactileModel& model, std::size_t probe,
                       std::string_view preset) {
  const Press& press = model.deepest()[probe];
  const std::string name = name_of_probe(model, probe);
  if (!press.touching()) return name + "never touched the skin\n";
  const double force_N = units::N_from_mN(press.contact.force_mN);
  const std::string law = drive_text(press, model.parameters().indenters[probe], preset) +
                          "  contact law: " + contact_sentence(press, model, probe) + "\n";
  if (model.parameters().indenters[probe].taxels() != nullptr) {
    return name +
           fmt::format(
               "hardest press {:.4g} N on {:.4g} mm² of taxels, highest pressure {:.4g} kPa",
               force_N, area_mm2(press.contact), press.contact.peak_pressure_kPa) +
           law;
  }
  std::string text =
      name + fmt::format("deepest press {:.4g} mm at ({:.4g}, {:.4g}) mm: force {:.4g} N",
                         press.contact.depth_mm, press.x_mm, press.y_mm, force_N);
  if (press.contact.touching()) {
    text += fmt::format(", contact radius {:.4g} mm, peak pressure {:.4g} kPa",
                        press.contact.contact_radius_mm, press.contact.peak_pressure_kPa);
  }
  if (const auto both = force_and_depth(report.probes[probe], model, probe)) {
    text += fmt::format(
        "\n  measured there: {:.4g} N at {:.4g} mm, for which the model gives {:.4g} N: ratio {:.2f}",
        both->force_N, both->depth_mm, both->model_force_N, both->ratio());
  }
  return text + law;
}

Json press_json(const TactileModel& model, std::size_t probe) {
  const Press& press = model.deepest()[probe];
  const Indenter& tip = model.parameters().indenters[probe];
  const bool round = press.contact.touching() && tip.sphere() != nullptr;
  const ContactValidity validity =
      round ? validity_of(press.contact, model.parameters().skin, tip.sphere()->radius_mm)
            : ContactValidity{};
  const auto if_true = [](bool exists, double value) { return exists ? Json(value) : Json(); };
  return {{"depth_mm", press.contact.depth_mm},
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

Json both_json(const RunReport& report, const TactileModel& model, std::size_t probe) {
  const auto both = force_and_depth(report.probes[probe], model, probe);
  if (!both) return {};
  return {{"force_N", both->force_N},
          {"depth_mm", both->depth_mm},
          {"model_force_N", both->model_force_N},
          {"ratio", both->ratio()}};
}

}  // namespace merkel
