#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/tip_field.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/inspect.hpp"

namespace merkel {
namespace {

/// Stress on the line through the axis of a press, at a depth. The coordinate r of the result is
/// x, so the shear changes its sign left of the axis.
class StressOnALine {
 public:
  StressOnALine(const InspectedPress& inspected, const std::vector<double>& z_mm)
      : inspected_(inspected), nu_(inspected.skin.poisson_ratio) {
    const ContactState& contact = inspected.press.contact;
    if (!contact.touching() && !(contact.depth_mm > 0.0)) return;
    for (const double z : z_mm) {
      SkinParameters at = inspected.skin;
      at.receptor_depth_mm = z;
      if (inspected.indenter.surface.slides) {
        surfaces_.push_back(settled(inspected, at));
      } else if (!inspected.indenter.circular(at)) {
        solved_.emplace_back(inspected.indenter, at, contact.depth_mm);
      }
    }
  }

  /// \param depth  index of the depth
  [[nodiscard]] AxisymmetricStress at(double x_mm, std::size_t depth, double z_mm) const {
    const ContactState& contact = inspected_.press.contact;
    if (!solved_.empty() || !surfaces_.empty()) {
      const SkinField field = surfaces_.empty() ? solved_[depth].at(x_mm, 0.0, contact.depth_mm)
                                                : surfaces_[depth]->at(x_mm, 0.0);
      const CartesianStress stress = field.stress * contact.stiffening;
      return {.sigma_r = stress.sigma_x,
              .sigma_theta = stress.sigma_y,
              .sigma_z = stress.sigma_z,
              .tau_rz = stress.tau_zx};
    }
    if (!contact.touching()) return {};
    const double r = std::fabs(x_mm);
    AxisymmetricStress stress = huber_stress(contact, nu_, r, z_mm);
    if (x_mm < 0.0) stress.tau_rz = -stress.tau_rz;
    return stress;
  }

 private:
  const InspectedPress& inspected_;
  double nu_;
  std::vector<TipField> solved_;
  std::vector<std::unique_ptr<SlidingContact>> surfaces_;
};

Expected<void, SetupError> check_depths(const InspectOptions& options,
                                        const InspectedPress& inspected) {
  if (options.printed == !options.z_mm.empty()) {
    return bad_input("give --z-mm, or --printed for the depth z = U(r)");
  }
  const bool solved = !inspected.indenter.circular(inspected.skin);
  if (solved && options.printed) {
    return bad_input(
        "--printed is for a circular contact: a sphere on a half-space with one radius; give --z-mm");
  }
  const double least =
      options.printed ? 0.0 : *std::min_element(options.z_mm.begin(), options.z_mm.end());
  if (solved && least < Indenter::kMinDepth_mm) {
    return bad_input("for this contact, --z-mm must be at least " +
                     shortest_decimal(Indenter::kMinDepth_mm) +
                     ": pressures vary from pixel to pixel");
  }
  const double bone_mm = inspected.skin.bone_depth_mm();
  if (solved && !(*std::max_element(options.z_mm.begin(), options.z_mm.end()) < bone_mm)) {
    return bad_input("--z-mm must be less than the depth of the bone, " +
                     shortest_decimal(bone_mm) + " mm: give a smaller one");
  }
  for (const double z : options.z_mm) {
    SkinParameters at = inspected.skin;
    at.receptor_depth_mm = z;
    if (!inspected.indenter.surface.slides || inspected.indenter.check(at)) continue;
    return bad_input("the surface has too many pixels for --z-mm " + shortest_decimal(z) +
                     ": give a larger one");
  }
  return {};
}

}  // namespace

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
