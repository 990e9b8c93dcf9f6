#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "core/contact/contact_validity.hpp"
#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/pressed_tip.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/contact/tip_field.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/inspect.hpp"
#include "tools/scene/contact_sentence.hpp"
#include "tools/studies/report/csv_table.hpp"
#include "tools/studies/report/plot_runner.hpp"

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
  const SkinParameters& skin = scene->model.skin;
  Indenter& indenter = scene->model.indenters.front();
  if (indenter.prescribed()) {
    return bad_input(
        "the tip \"taxels\" makes no contact that can be computed: its pressures are "
        "measured; run the scene to see what they do");
  }
  if (indenter.surface.slides) {
    return bad_input(
        "the scene's tip is a surface, which is solved while it slides: run the scene, or "
        "set surface = false to inspect one press");
  }
  if (options.all_depths && !options.depth_mm && !options.force_N && !indenter.closed_form(skin)) {
    return InspectedPress{skin, indenter, {}};
  }
  if (options.depth_mm.has_value() == options.force_N.has_value()) {
    return bad_input("give either --depth-mm or --force-N");
  }
  if (options.depth_mm && !indenter.closed_form(skin)) {
    // The solver needs no tables for one depth.
    const double depth_mm = *options.depth_mm;
    const double pressure_kPa = std::isfinite(skin.stiffening_kPa)
                                    ? TipField(indenter, skin, depth_mm).mean_pressure_kPa(depth_mm)
                                    : 0.0;
    return InspectedPress{skin,
                          indenter,
                          {.contact = {.depth_mm = depth_mm,
                                       .stiffening = skin.stiffening_at(depth_mm, pressure_kPa)}}};
  }
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
      if (!inspected.indenter.closed_form(at)) {
        solved_.emplace_back(inspected.indenter, at, contact.depth_mm);
      } else if (inspected.skin.exactly_layered()) {
        layers_.emplace_back(at, contact.contact_radius_mm);
      }
    }
  }

  /// \param depth  index of the depth
  [[nodiscard]] AxisymmetricStress at(double x_mm, std::size_t depth, double z_mm) const {
    const ContactState& contact = inspected_.press.contact;
    if (!solved_.empty()) {
      const CartesianStress stress =
          solved_[depth].at(x_mm, 0.0, contact.depth_mm).stress * contact.stiffening;
      return {.sigma_r = stress.sigma_x,
              .sigma_theta = stress.sigma_y,
              .sigma_z = stress.sigma_z,
              .tau_rz = stress.tau_zx};
    }
    if (!contact.touching()) return {};
    const double r = std::fabs(x_mm);
    AxisymmetricStress stress =
        layers_.empty() ? huber_stress(contact, nu_, r, z_mm) : layers_[depth].stress(contact, r);
    if (x_mm < 0.0) stress.tau_rz = -stress.tau_rz;
    return stress;
  }

 private:
  const InspectedPress& inspected_;
  double nu_;
  std::vector<TipField> solved_;
  std::vector<LayerField> layers_;
};

Expected<void, SetupError> check_depths(const InspectOptions& options,
                                        const InspectedPress& inspected) {
  if (options.printed == !options.z_mm.empty()) {
    return bad_input("give --z-mm, or --printed for the depth z = U(r)");
  }
  const bool solved = !inspected.indenter.closed_form(inspected.skin);
  if (solved && options.printed) {
    return bad_input("--printed is for a sphere on skin without layers: give --z-mm");
  }
  const double least =
      options.printed ? 0.0 : *std::min_element(options.z_mm.begin(), options.z_mm.end());
  if (solved && least < LayerField::kLeastDepth_mm) {
    return bad_input("for this tip, --z-mm must be at least " +
                     shortest_decimal(LayerField::kLeastDepth_mm) +
                     ": the pressure at its rims is infinite");
  }
  if (!solved && !options.printed && inspected.skin.exactly_layered()) {
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

/// Writes gap, pressure and energy density around a solved tip as a table and draws them.
Expected<void, SetupError> draw(const InspectedPress& inspected, const TipField& field,
                                const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return bad_input("cannot make the folder " + folder + ": " + error.message());
  auto table =
      CsvTable::create(folder + "/contact.csv", "x_mm,y_mm,gap_mm,pressure_kPa,sed_kPa", true);
  if (!table) return Unexpected<SetupError>(table.error());
  const ContactState& contact = inspected.press.contact;
  const SkinMaterial skin(inspected.skin);
  const PressTables& press = field.tables();
  const TipHeight gap = pressed_tip(inspected.indenter, inspected.skin).gap;
  // Twice as wide as the contact, in whole pixels around its middle.
  PixelGrid shown = press.contact;
  shown.columns += 2 * (shown.columns / 2);
  shown.rows += 2 * (shown.rows / 2);
  const std::size_t beside = (shown.columns - press.contact.columns) / 2;
  const std::size_t before = (shown.rows - press.contact.rows) / 2;
  for (std::size_t row = 0; row < shown.rows; ++row) {
    for (std::size_t column = 0; column < shown.columns; ++column) {
      const double x = shown.x_mm(column);
      const double y = shown.y_mm(row);
      const bool inside = column >= beside && column - beside < press.contact.columns &&
                          row >= before && row - before < press.contact.rows;
      const double pressure =
          inside ? press.pressure_kPa[(row - before) * press.contact.columns + column - beside]
                 : 0.0;
      const CartesianStress stress = field.at(x, y, contact.depth_mm).stress;
      table->row(
          {x, y, gap(x, y), contact.stiffening * pressure,
           contact.stiffening * energy_density_kPa(stress, skin, inspected.skin.energy_density)});
    }
  }
  if (auto closed = table->close(); !closed) return closed;
  return draw_plots("contact", folder);
}

/// Prints what the solver finds at the depth of a press, or at all depths of the scene's tables.
int print_solved(const InspectedPress& inspected, const std::string& folder) {
  const ContactState& contact = inspected.press.contact;
  const bool one = contact.depth_mm > 0.0;
  const TipField field = one ? TipField(inspected.indenter, inspected.skin, contact.depth_mm)
                             : TipField(inspected.indenter, inspected.skin);
  std::printf("depth_mm,force_N,contact_mm2,peak_pressure_kPa,largest_sed_kPa,pixel_mm\n");
  for (const PressTables::Table& table : field.tables().tables) {
    if (!(table.depth_mm > 0.0)) continue;
    const double rest_mN = table.force_mN_per_mm * table.depth_mm;
    const double stiffening =
        inspected.skin.stiffening_at(table.depth_mm, rest_mN / table.area_mm2);
    std::printf(
        "%.12g,%.6g,%.6g,%.6g,%.6g,%.6g\n", table.depth_mm, units::N_from_mN(stiffening * rest_mN),
        table.area_mm2, stiffening * table.peak_pressure_kPa,
        stiffening * field.largest_energy_kPa(table.depth_mm), field.tables().contact.pixel_mm);
  }
  std::fprintf(stderr, "%s\n",
               contact_sentence(contact, inspected.indenter, inspected.skin).c_str());
  if (folder.empty()) return kDone;
  if (!one) return refuse("to draw a contact, give --depth-mm or --force-N");
  if (const auto drawn = draw(inspected, field, folder); !drawn) return refuse(drawn.error());
  return kDone;
}

}  // namespace

int inspect_contact(const InspectOptions& given) {
  InspectOptions options = given;
  options.all_depths = true;
  const auto inspected = press_of(options);
  if (!inspected) return refuse(inspected.error());
  const ContactState& contact = inspected->press.contact;
  if (!inspected->indenter.closed_form(inspected->skin)) {
    return print_solved(*inspected, options.folder);
  }
  if (!options.folder.empty()) {
    return refuse(
        "--draw is for solved contacts: all tips but a sphere, or skin with [[skin.layer]]");
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
