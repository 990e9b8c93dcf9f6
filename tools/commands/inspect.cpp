#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/neuron/hodgkin_huxley_population.hpp"
#include "core/scene/tip_contact.hpp"
#include "core/skin/contact_validity.hpp"
#include "core/skin/hertz_contact.hpp"
#include "core/skin/huber_stress.hpp"
#include "core/skin/line_load.hpp"
#include "core/skin/pin_contact.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene_presets.hpp"

namespace merkel {
namespace {

struct InspectOptions {
  std::string scene;
  std::optional<double> radius_mm;
  std::optional<double> depth_mm;
  std::optional<double> force_N;
  std::vector<double> r_mm;
  std::vector<double> z_mm;
  bool printed = false;
  std::optional<double> current;
  std::vector<double> ramp;
  double duration_ms = 200.0;
  std::string method = "crank_nicolson";
  double step_us = 25.0;
  std::vector<std::string> settings;
};

Expected<Scene, SetupError> scene_of(const InspectOptions& options) {
  auto scene = scene_named(options.scene);
  if (!scene) return scene;
  Indenter& indenter = scene->model.indenters.front();
  indenter.radius_mm = options.radius_mm.value_or(indenter.radius_mm);
  const auto checked = ParameterCheck()
                           .also(scene->model.skin.check())
                           .also(indenter.check(scene->model.skin))
                           .result();
  if (!checked) return bad_input(scene->sentence(checked.error()));
  return scene;
}

/// The tip that a command line presses with, and its press.
struct InspectedPress {
  SkinParameters skin;
  Indenter indenter;
  Press press;
};

Expected<InspectedPress, SetupError> press_of(const InspectOptions& options) {
  auto scene = scene_of(options);
  if (!scene) return Unexpected<SetupError>(scene.error());
  if (options.depth_mm.has_value() == options.force_N.has_value()) {
    return bad_input("give either --depth-mm or --force-N");
  }
  const SkinParameters& skin = scene->model.skin;
  Indenter& indenter = scene->model.indenters.front();
  indenter.control = options.depth_mm ? Indenter::Control::kDepth : Indenter::Control::kForce;
  const Press press = TipContact(indenter, skin)
                          .press({.depth_mm = options.depth_mm.value_or(0.0),
                                  .force_mN = units::mN_from_N(options.force_N.value_or(0.0))});
  if (indenter.tip == Indenter::Tip::kSphere && options.force_N &&
      press.contact.depth_mm > indenter.radius_mm) {
    return bad_input("--force-N " + shortest_decimal(*options.force_N) + " would need a depth of " +
                     shortest_decimal(press.contact.depth_mm) +
                     " mm, more than the sphere's radius: no contact law reaches that far; give a "
                     "smaller force or a larger --radius-mm");
  }
  return InspectedPress{skin, indenter, press};
}

int inspect_contact(const InspectOptions& options) {
  const auto inspected = press_of(options);
  if (!inspected) return refuse(inspected.error());
  const SphereContact& contact = inspected->press.contact;
  if (inspected->indenter.tip != Indenter::Tip::kSphere) {
    std::printf("force_N,depth_mm\n%.12g,%.12g\n", units::N_from_mN(contact.force_mN),
                contact.depth_mm);
    return kDone;
  }
  const ContactValidity validity =
      validity_of(contact, inspected->skin, inspected->indenter.radius_mm);
  std::printf(
      "contact_radius_mm,force_N,peak_pressure_kPa,depth_mm,radius_ratio,sphere_force_error,"
      "layer_ratio,layer_force_error,valid\n");
  std::printf("%.12g,%.12g,%.12g,%.12g,%.6g,%.6g,%.6g,%.6g,%s\n", contact.contact_radius_mm,
              units::N_from_mN(contact.force_mN), contact.peak_pressure_kPa, contact.depth_mm,
              validity.radius_ratio, validity.sphere_force_error, validity.layer_ratio,
              validity.layer_force_error, validity.within ? "true" : "false");
  std::fprintf(stderr, "%s\n", validity.sentence().c_str());
  return kDone;
}

/// Stress under a bar tip on its middle line, x from the middle of the tip.
AxisymmetricStress bar_stress(const BarContact& contact, double depth_mm, double poisson_ratio,
                              double x_mm, double z_mm) {
  CartesianStress sum;
  for (const LineLoad& load : contact.loads) {
    sum += line_load_stress(load, poisson_ratio, x_mm, 0.0, z_mm) * depth_mm;
  }
  return {.sigma_r = sum.sigma_x,
          .sigma_theta = sum.sigma_y,
          .sigma_z = sum.sigma_z,
          .tau_rz = sum.tau_zx};
}

int inspect_field(const InspectOptions& options) {
  const auto inspected = press_of(options);
  if (!inspected) return refuse(inspected.error());
  const bool bars = inspected->indenter.tip == Indenter::Tip::kBars;
  const bool pin = inspected->indenter.tip == Indenter::Tip::kPin;
  if (options.printed == !options.z_mm.empty()) {
    return refuse("give --z-mm, or --printed for the depth z = U(r)");
  }
  if ((bars || pin) &&
      (options.printed || *std::min_element(options.z_mm.begin(), options.z_mm.end()) <= 0.0)) {
    return refuse("under a flat tip, give --z-mm above 0: its edges press infinitely hard");
  }
  const SkinMaterial skin(inspected->skin);
  const double nu = skin.poisson_ratio();
  const SphereContact& contact = inspected->press.contact;
  BarContact bar_contact;
  if (bars) {
    bar_contact = BarContact::solve(inspected->indenter.bars, skin.reduced_modulus_kPa(),
                                    *std::min_element(options.z_mm.begin(), options.z_mm.end()));
  }
  std::printf("r_mm,z_mm,sigma_r_kPa,sigma_theta_kPa,sigma_z_kPa,tau_rz_kPa,sed_kPa\n");
  const auto print = [&](double r, double z, const AxisymmetricStress& stress) {
    std::printf("%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g\n", r, z, stress.sigma_r,
                stress.sigma_theta, stress.sigma_z, stress.tau_rz,
                energy_density_kPa(stress, skin, inspected->skin.energy_density));
  };
  for (const double r : options.r_mm) {
    if (options.printed) {
      const double z = HertzContact::surface_displacement_mm(contact, r);
      print(r, z,
            contact.touching() ? point_load_stress(contact.force_mN, nu, r, z)
                               : AxisymmetricStress{});
    }
    for (const double z : options.z_mm) {
      print(r, z,
            bars ? bar_stress(bar_contact, contact.depth_mm, nu, r, z)
            : pin
                ? pin_stress(contact.force_mN, 0.5 * inspected->indenter.pin.diameter_mm, nu, r, z)
                : huber_stress(contact, nu, r, z));
    }
  }
  return kDone;
}

/// Sets a neuron parameter by its name, "gCaL=0" or "g_CaL=0".
Expected<void, SetupError> apply_setting(const std::string& setting, HodgkinHuxley& neuron) {
  struct Named {
    const char* name;
    double HodgkinHuxley::*member;
  };
  constexpr std::array<Named, 10> kNamed = {{{"gNa", &HodgkinHuxley::g_Na},
                                             {"gK", &HodgkinHuxley::g_K},
                                             {"gL", &HodgkinHuxley::g_L},
                                             {"gCaL", &HodgkinHuxley::g_CaL},
                                             {"ENa", &HodgkinHuxley::E_Na},
                                             {"EK", &HodgkinHuxley::E_K},
                                             {"ECa", &HodgkinHuxley::E_Ca},
                                             {"Vrest", &HodgkinHuxley::V_rest},
                                             {"C", &HodgkinHuxley::capacitance_uF_per_cm2},
                                             {"threshold", &HodgkinHuxley::spike_threshold_mV}}};
  const auto equals = setting.find('=');
  std::string name = setting.substr(0, equals);
  std::erase(name, '_');
  const auto value =
      equals == std::string::npos ? std::nullopt : parse_number(setting.substr(equals + 1));
  for (const Named& named : kNamed) {
    if (name != named.name) continue;
    if (!value) break;
    neuron.*named.member = *value;
    return {};
  }
  return bad_input("--set " + setting +
                   " is not understood: write NAME=NUMBER with gNa, gK, gL, gCaL, ENa, EK, ECa, "
                   "V_rest, C or threshold");
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(word);
  return text;
}

/// The injected current at a time: constant, or 0 to t0, up to I at t1, held to t2, 0 from t3.
double injected(const InspectOptions& options, double time_ms) {
  if (options.current) return *options.current;
  const double t0 = options.ramp[0];
  const double t1 = options.ramp[1];
  const double t2 = options.ramp[2];
  const double t3 = options.ramp[3];
  const double peak = options.ramp[4];
  if (time_ms < t0 || time_ms >= t3) return 0.0;
  if (time_ms < t1) return peak * (time_ms - t0) / (t1 - t0);
  if (time_ms <= t2) return peak;
  return peak * (t3 - time_ms) / (t3 - t2);
}

int inspect_neuron(const InspectOptions& options) {
  auto scene = scene_of(options);
  if (!scene) return refuse(scene.error());
  HodgkinHuxley& neuron = scene->model.neuron;
  for (const std::string& setting : options.settings) {
    if (auto set = apply_setting(setting, neuron); !set) return refuse(set.error());
  }
  const auto method = integration_method_named(options.method);
  const std::chrono::nanoseconds step = units::nanoseconds_from_us(options.step_us);
  const bool ordered = options.ramp.empty() ||
                       (options.ramp[0] <= options.ramp[1] && options.ramp[1] <= options.ramp[2] &&
                        options.ramp[2] <= options.ramp[3]);
  const auto checked =
      ParameterCheck()
          .also(neuron.check())
          .require(method.has_value(), "--method",
                   "must be one of " + joined(integration_method_names()))
          .require(step.count() > 0, "--step-us", "must be at least 0.001")
          .require(options.current.has_value() == options.ramp.empty(), "--current",
                   "or --ramp must be given, and not both")
          .require(ordered, "--ramp", "must have its times in order: t0,t1,t2,t3,I")
          .result();
  if (!checked) {
    return refuse(checked.error().key + " " + checked.error().reason);
  }

  HodgkinHuxleyPopulation population(
      {.neuron = neuron, .method = *method, .step = step, .freeze_resting = false}, 1,
      std::nullopt);
  SpikeBuffer spikes(2);
  std::printf("spike,time_ms\n");
  std::uint64_t number = 0;
  std::uint64_t resets = 0;
  const auto end = units::nanoseconds_from_ms(options.duration_ms);
  for (std::chrono::nanoseconds time{0}; time < end; time += step) {
    const double begin_current = injected(options, units::ms_from(time));
    const double end_current = injected(options, units::ms_from(time + step));
    spikes.clear();
    population.advance({&begin_current, 1}, {&end_current, 1}, 1, time, spikes);
    resets += population.resets().size();
    for (const SpikeEvent& spike : std::as_const(spikes).events()) {
      std::printf("%llu,%.6f\n", static_cast<unsigned long long>(++number),
                  units::ms_from(spike.time));
    }
  }
  if (resets > 0) {
    return fail("the membrane's state became non-finite " + std::to_string(resets) +
                " times: make --step-us smaller");
  }
  return kDone;
}

int inspect_receptors(const InspectOptions& options) {
  const auto scene = scene_of(options);
  if (!scene) return refuse(scene.error());
  const auto& patches = scene->model.patches;
  const bool several = patches.size() > 1;
  std::printf("receptor,x_mm,y_mm,neuron%s\n", several ? ",patch" : "");
  for (const TactileModel::PatchParameters& patch : patches) {
    const auto receptors = place_receptors(patch.receptors, patch.patch);
    if (!receptors) return refuse(scene->sentence(receptors.error()));
    std::size_t number = 0;
    for (const Receptor& receptor : *receptors) {
      std::printf("%zu,%.12g,%.12g,%u", ++number, receptor.x_mm, receptor.y_mm, receptor.neuron);
      std::printf(several ? ",%s\n" : "\n", patch.name.c_str());
    }
  }
  return kDone;
}

}  // namespace

void add_inspect_command(CommandLine& program) {
  auto options = std::make_shared<InspectOptions>();
  CommandLine command = program.subcommand(
      "inspect", "Prints the parts of the model, or of a recorded session, by themselves, as CSV.",
      "inspect contact --radius-mm 2 --depth-mm 1.5");
  command.require_subcommand();

  CommandLine contact =
      command.subcommand("contact", "Contact radius, force and peak pressure of a press.",
                         "inspect contact --radius-mm 2 --depth-mm 1.5");
  CommandLine field =
      command.subcommand("field", "Stress and strain energy density under a press.",
                         "inspect field --radius-mm 2 --depth-mm 1.5 --r-mm 0,1,2 --z-mm 0.65");
  for (CommandLine* const press : {&contact, &field}) {
    press->option("--radius-mm", options->radius_mm, "Radius of the sphere, mm", {-1e9, 1e300})
        .option("--depth-mm", options->depth_mm, "Indentation depth, mm", {0.0, 1e3})
        .option("--force-N", options->force_N, "Force, N", {0.0, 1e4})
        .option("--scene", options->scene, "Scene whose skin and tip to take");
  }
  contact.runs([options] { return inspect_contact(*options); });
  field
      .list("--r-mm", options->r_mm,
            "Distances from the axis, mm, separated by commas; under bars, x on the middle line",
            {0.0, 1e6})
      .required()
      .list("--z-mm", options->z_mm, "Depths below the surface, mm, separated by commas",
            {0.0, 1e6})
      .flag("--printed", options->printed,
            "Instead: the paper's printed form, a point load seen from the depth z = U(r)")
      .runs([options] { return inspect_field(*options); });

  command
      .subcommand("neuron", "Spike times of one neuron under an injected current.",
                  "inspect neuron --current 10 --duration-ms 200 --method rk4 --step-us 5")
      .option("--current", options->current, "Constant current from 0 ms, µA/cm²", {-1e6, 1e6})
      .list("--ramp", options->ramp,
            "t0,t1,t2,t3,I: rises from t0 to t1, falls from t2 to t3 (ms); I in µA/cm²",
            {-1e9, 1e9}, 5)
      .option("--duration-ms", options->duration_ms, "How long, ms", {1e-3, 1e9})
      .option("--method", options->method, "Integration method")
      .option("--step-us", options->step_us, "Membrane step, µs", {1e-3, 1e6})
      .list("--set", options->settings, "NAME=NUMBER, for example gCaL=0; repeatable")
      .option("--scene", options->scene, "Scene whose neuron to take")
      .runs([options] { return inspect_neuron(*options); });

  command
      .subcommand("receptors", "The receptors of a scene, as they are drawn.",
                  "inspect receptors scene.toml")
      .option("scene", options->scene, "Scene file or preset")
      .runs([options] { return inspect_receptors(*options); });
  add_inspect_session_command(command);
}

}  // namespace merkel
