#include <algorithm>
#include <cstdio>

#include "core/contact/contact_validity.hpp"
#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/pin_contact.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/skin/line_load.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/inspect.hpp"

namespace merkel {
namespace {

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

}  // namespace

int inspect_contact(const InspectOptions& options) {
  const auto inspected = press_of(options);
  if (!inspected) return refuse(inspected.error());
  const ContactState& contact = inspected->press.contact;
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
  const ContactState& contact = inspected->press.contact;
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

}  // namespace merkel
