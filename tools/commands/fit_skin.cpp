#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>

#include <fmt/core.h>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/printable_text.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/report/report.hpp"
#include "tools/studies/score/skin_fit.hpp"

namespace merkel {
namespace {

struct FitSkinCommand {
  std::string trace;
  std::string scene = "finger";
  std::optional<double> radius_mm;
  std::optional<double> diameter_mm;
  bool plate = false;
  std::string out = "skin.toml";
  bool overwrite = false;
};

/// From this relative standard error on, a parameter counts as undetermined.
constexpr double kPoor = 0.3;

std::string with_error(double relative_error) {
  return fmt::format("± {:.1f} %{}", 100.0 * relative_error,
                     relative_error < kPoor ? "" : ", which the recording does not determine");
}

const char* stiffening_law(const SkinFit& fit) {
  return fit.by_pressure ? "E*(p) = E0·(1 + p/p1)" : "E*(d) = E0·e^(d/d1)";
}

const char* stiffening_unit(const SkinFit& fit) { return fit.by_pressure ? "kPa" : "mm"; }

std::string report_of(const SkinFit& fit) {
  std::string text = fmt::format("{} samples up to {:.3g} mm and {:.4g} N\n", fit.samples,
                                 fit.deepest_mm, 1e-3 * fit.loading.back().force_mN);
  text += fmt::format("{}: E0 = {:.4g} kPa {}\n", stiffening_law(fit), fit.modulus_kPa,
                      with_error(fit.modulus_error));
  if (fit.stiffens) {
    text += fmt::format("                     {} = {:.4g} {} {}; correlation with E0 {:.2f}\n",
                        fit.by_pressure ? "p1" : "d1", fit.stiffening, stiffening_unit(fit),
                        with_error(fit.stiffening_error), fit.correlation);
  } else {
    text += "                     no stiffening: the contact law alone explains the force\n";
  }
  text += fmt::format(
      "residuals: weighted {:.3g} % rms (relative; absolute near the noise); unweighted {:.3g} mN rms, {:.3g} mN "
      "maximum; R² = {:.4f}\n",
      100.0 * fit.rms_weighted, fit.rms_mN, fit.largest_mN, fit.r2);
  text += fit.unloaded
              ? fmt::format(
                    "hysteresis: unloading loses {:.0f} % of the work of loading; the model is "
                    "elastic and loses none\n",
                    std::round(100.0 * fit.hysteresis) + 0.0)  // no "-0"
              : "hysteresis: not measured, because the recording has no unloading phase\n";
  text += "depth_mm,force_N,model_N\n";
  const std::size_t stride = std::max<std::size_t>(1, fit.samples / 12);
  for (std::size_t i = 0; i < fit.samples; i += stride) {
    text += fmt::format("{:.4g},{:.4g},{:.4g}\n", fit.loading[i].depth_mm,
                        1e-3 * fit.loading[i].force_mN, 1e-3 * fit.predicted_mN[i]);
  }
  return text;
}

/// Sets the fitted skin, in six digits, and the tip that pressed, of the first probe.
void set_fitted(TactileModel::Parameters& model, const Indenter& tip, const SkinFit& fit) {
  const auto rounded = [](double value) { return std::stod(fmt::format("{:.6g}", value)); };
  SkinParameters& skin = model.skin;
  const double ratio = fit.modulus_kPa / SkinMaterial(skin).reduced_modulus_kPa();
  for (SkinLayer& layer : skin.layers.all()) {
    layer.youngs_modulus_kPa = rounded(ratio * layer.youngs_modulus_kPa);
  }
  const double nu = skin.poisson_ratio;
  skin.epidermis_kPa = skin.dermis_kPa = rounded(fit.modulus_kPa * (1.0 - nu * nu));
  (fit.by_pressure ? skin.stiffening_kPa : skin.stiffening_mm) = rounded(fit.stiffening);
  model.indenters.front().tip = tip.tip;
}

int fit_skin_command(const FitSkinCommand& command) {
  if (command.radius_mm.has_value() + command.diameter_mm.has_value() + command.plate != 1) {
    return refuse(
        "set the shape of the tip: --radius-mm for a sphere, --diameter-mm for a flat pin, or "
        "--plate");
  }
  auto scene = scene_named(command.scene);
  if (!scene) return refuse(scene.error());
  Indenter tip;
  if (command.diameter_mm) {
    tip.tip = PinTip{.diameter_mm = *command.diameter_mm};
  } else {
    tip.tip = SphereTip{command.radius_mm.value_or(std::numeric_limits<double>::infinity())};
  }
  if (const auto checked = tip.check(scene->model.skin); !checked) {
    const ParameterError& error = checked.error();
    return refuse(error.key.starts_with("probe.")
                      ? "the tip's " + error.key.substr(6) + " " + error.reason
                      : scene->sentence(error));
  }
  const auto press =
      read_force_depth(command.trace, scene->probes.front().input.contact.invert_force);
  if (!press) return refuse(press.error());
  const auto fit = fit_skin(*press, tip, scene->model.skin);
  if (!fit) return refuse(command.trace + ": " + fit.error().sentence);
  auto out = OutputFile::create(command.out, command.overwrite);
  if (!out) return refuse(out.error());
  std::fputs(report_of(*fit).c_str(), stdout);
  set_fitted(scene->model, tip, *fit);
  if (const auto model = TactileModel::create(scene->model); !model) {
    return refuse("the fitted scene cannot be simulated: " + scene->sentence(model.error()));
  }
  const std::string heading =
      "# Made by merkel fit skin " + printable_text(command.scene) + " --trace " +
      printable_text(command.trace) +
      fmt::format(": {}, E0 = {:.4g} kPa, {} = {:.4g} {}, R² = {:.4f}.\n", stiffening_law(*fit),
                  fit->modulus_kPa, fit->by_pressure ? "p1" : "d1", fit->stiffening,
                  stiffening_unit(*fit), fit->r2);
  if (!out->write(heading + scene_text(*scene)) || !out->close()) return fail(out->error());
  std::printf("\nwrote %s; use it with merkel run %s\n", command.out.c_str(), command.out.c_str());
  return kDone;
}

}  // namespace

void add_fit_skin_command(CommandLine& fit) {
  auto command = std::make_shared<FitSkinCommand>();
  fit.subcommand(
         "skin",
         "Fits the modulus and the stiffening of a finger or phantom, E*(d) = E0·e^(d/d1), or "
         "E*(p) = E0·(1 + p/p1) if the scene has skin.stiffening_kPa, "
         "to a press recorded with depth and force; reports residuals, hysteresis and how "
         "well each is determined, and writes a scene.",
         "fit skin finger --trace press.csv --plate --out skin.toml")
      .option("scene", command->scene,
              "Scene file (TOML) or preset that gives everything else: curvature, layer, contact "
              "law, afferents; default finger. The tip becomes that of its first probe")
      .option("--trace", command->trace,
              "Recorded press (CSV with the columns time_s, depth_mm, force_N)")
      .required()
      .option("--radius-mm", command->radius_mm, "Radius of the sphere that pressed, mm",
              {1e-3, 1e6})
      .option("--diameter-mm", command->diameter_mm, "Diameter of the flat pin that pressed, mm",
              {1e-3, 1e3})
      .flag("--plate", command->plate, "The tip was a flat plate")
      .option("--out", command->out, "Scene to write (TOML)")
      .flag("--overwrite", command->overwrite, "Replace existing files")
      .runs([command] { return fit_skin_command(*command); });
}

}  // namespace merkel
