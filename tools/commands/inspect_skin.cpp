#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/contact/bar_press.hpp"
#include "core/contact/contact_validity.hpp"
#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/skin/line_load.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/inspect.hpp"
#include "tools/scene/contact_sentence.hpp"

namespace merkel {
namespace {

/// The tip and the press that a command line describes.
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

/// Stress under a bar tip in its central plane; x is from the centre of the tip.
AxisymmetricStress bar_stress(const BarContact& contact, double poisson_ratio, double x_mm,
                              double z_mm) {
  CartesianStress sum;
  for (const LineLoad& load : contact.loads) {
    sum += line_load_stress(load, poisson_ratio, x_mm, 0.0, z_mm);
  }
  return {.sigma_r = sum.sigma_x,
          .sigma_theta = sum.sigma_y,
          .sigma_z = sum.sigma_z,
          .tau_rz = sum.tau_zx};
}

/// Stress on the line through the centre of a press, at a depth. The coordinate r of the result is
/// x, so the shear changes its sign left of the axis.
class StressOnALine {
 public:
  StressOnALine(const InspectedPress& inspected, const std::vector<double>& z_mm)
      : inspected_(inspected), nu_(inspected.skin.poisson_ratio) {
    if (inspected.indenter.tip == Indenter::Tip::kBars) {
      bars_ = loads_under_bars(inspected.indenter.bars, inspected.skin,
                               inspected.press.contact.depth_mm,
                               *std::min_element(z_mm.begin(), z_mm.end()));
      return;
    }
    for (const double z : z_mm) {
      SkinParameters at = inspected.skin;
      at.receptor_depth_mm = z;
      if (inspected.indenter.tip == Indenter::Tip::kPin) {
        pins_.emplace_back(inspected.indenter.pin, at);
      } else if (inspected.skin.exactly_layered()) {
        layers_.emplace_back(at, inspected.press.contact.contact_radius_mm);
      }
    }
  }

  /// \param depth  index of the depth
  [[nodiscard]] AxisymmetricStress at(double x_mm, std::size_t depth, double z_mm) const {
    const ContactState& contact = inspected_.press.contact;
    if (inspected_.indenter.tip == Indenter::Tip::kBars) {
      AxisymmetricStress stress = bar_stress(bars_, nu_, x_mm, z_mm);
      for (double* const part :
           {&stress.sigma_r, &stress.sigma_theta, &stress.sigma_z, &stress.tau_rz}) {
        *part *= contact.stiffening;
      }
      return stress;
    }
    const double r = std::fabs(x_mm);
    if (!pins_.empty()) {
      const CartesianStress stress =
          pins_[depth].at(x_mm, 0.0, contact.depth_mm).stress * contact.stiffening;
      return {.sigma_r = stress.sigma_x,
              .sigma_theta = stress.sigma_y,
              .sigma_z = stress.sigma_z,
              .tau_rz = stress.tau_zx};
    }
    AxisymmetricStress stress =
        layers_.empty() ? huber_stress(contact, nu_, r, z_mm) : layers_[depth].stress(contact, r);
    if (x_mm < 0.0) stress.tau_rz = -stress.tau_rz;
    return stress;
  }

 private:
  const InspectedPress& inspected_;
  double nu_;
  BarContact bars_;
  std::vector<FlatTipField> pins_;
  std::vector<LayerField> layers_;
};

Expected<void, SetupError> check_depths(const InspectOptions& options,
                                        const InspectedPress& inspected) {
  if (options.printed == !options.z_mm.empty()) {
    return bad_input("give --z-mm, or --printed for the depth z = U(r)");
  }
  const bool flat = inspected.indenter.tip != Indenter::Tip::kSphere;
  if (flat && options.printed) {
    return bad_input("--printed is for a sphere: for a flat tip, give --z-mm");
  }
  const double least =
      options.printed ? 0.0 : *std::min_element(options.z_mm.begin(), options.z_mm.end());
  if (flat && least < LayerField::kLeastDepth_mm) {
    return bad_input("for a flat tip, --z-mm must be at least " +
                     shortest_decimal(LayerField::kLeastDepth_mm) +
                     ": the pressure at its edges is infinite");
  }
  if (!flat && !options.printed && inspected.skin.exactly_layered()) {
    const double most = *std::max_element(options.z_mm.begin(), options.z_mm.end());
    if (least < LayerField::kLeastDepth_mm || !(most < inspected.skin.thickness_mm)) {
      return bad_input("with skin.layer_law = \"exact\", give --z-mm from " +
                       shortest_decimal(LayerField::kLeastDepth_mm) +
                       " to less than skin.thickness_mm, " +
                       shortest_decimal(inspected.skin.thickness_mm));
    }
  }
  return {};
}

}  // namespace

int inspect_contact(const InspectOptions& options) {
  const auto inspected = press_of(options);
  if (!inspected) return refuse(inspected.error());
  const ContactState& contact = inspected->press.contact;
  if (inspected->indenter.tip != Indenter::Tip::kSphere) {
    std::printf("force_N,depth_mm\n%.12g,%.12g\n", units::N_from_mN(contact.force_mN),
                contact.depth_mm);
    std::fprintf(stderr, "%s\n",
                 contact_sentence(contact, inspected->indenter, inspected->skin).c_str());
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
  if (const auto checked = check_depths(options, *inspected); !checked) {
    return refuse(checked.error());
  }
  const SkinMaterial skin(inspected->skin);
  const ContactState& contact = inspected->press.contact;
  const StressOnALine line(*inspected, options.z_mm);
  std::printf("r_mm,z_mm,sigma_r_kPa,sigma_theta_kPa,sigma_z_kPa,tau_rz_kPa,sed_kPa\n");
  const auto print = [&](double r, double z, const AxisymmetricStress& stress) {
    std::printf(
        "%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g\n", r, z, stress.sigma_r, stress.sigma_theta,
        stress.sigma_z, stress.tau_rz,
        energy_density_kPa(stress, skin, inspected->skin.energy_density) / contact.stiffening);
  };
  for (const double r : options.r_mm) {
    if (options.printed) {
      const double z = HertzContact::surface_displacement_mm(contact, std::fabs(r));
      print(r, z,
            contact.touching()
                ? point_load_stress(contact.force_mN, skin.poisson_ratio(), std::fabs(r), z)
                : AxisymmetricStress{});
    }
    for (std::size_t k = 0; k < options.z_mm.size(); ++k) {
      print(r, options.z_mm[k], line.at(r, k, options.z_mm[k]));
    }
  }
  return kDone;
}

}  // namespace merkel
