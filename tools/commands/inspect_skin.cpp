#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>

#include "core/contact/contact_validity.hpp"
#include "core/contact/pressed_tip.hpp"
#include "core/contact/sliding_contact.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/contact/tip_field.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/inspect.hpp"
#include "tools/scene/contact_sentence.hpp"
#include "tools/studies/report/csv_table.hpp"
#include "tools/studies/report/plot_runner.hpp"

namespace merkel {

std::unique_ptr<SlidingContact> settled(const InspectedPress& inspected,
                                        const SkinParameters& skin) {
  auto sliding = std::make_unique<SlidingContact>(inspected.indenter, skin, inspected.tick, 0.0);
  sliding->settle(inspected.input);
  return sliding;
}

Expected<InspectedPress, SetupError> press_of(const InspectOptions& options) {
  auto scene = scene_of(options);
  if (!scene) return Unexpected<SetupError>(scene.error());
  const SkinParameters& skin = scene->model.skin;
  Indenter& indenter = scene->model.indenters.front();
  if (indenter.taxels() != nullptr) {
    return bad_input(
        "the tip \"taxels\" makes no contact that can be computed: its pressures are "
        "measured; run the scene to see what they do");
  }
  if (options.all_depths && !indenter.surface.slides && !options.depth_mm && !options.force_N &&
      !indenter.closed_form(skin)) {
    return InspectedPress{skin, indenter, {}};
  }
  if (options.depth_mm.has_value() == options.force_N.has_value()) {
    return bad_input("give either --depth-mm or --force-N");
  }
  indenter.control = options.depth_mm ? Indenter::Control::kDepth : Indenter::Control::kForce;
  const ContactInput input{.depth_mm = options.depth_mm.value_or(0.0),
                           .force_mN = units::mN_from_N(options.force_N.value_or(0.0))};
  if (indenter.surface.slides) {
    InspectedPress inspected{skin, indenter, {}, input, scene->model.tick};
    inspected.input.x_mm = skin.apex->x_mm;
    inspected.input.y_mm = skin.apex->y_mm;
    inspected.press = settled(inspected, skin)->press();
    return inspected;
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
  Press press;
  if (indenter.closed_form(skin)) {
    const SphereLaw law(skin, indenter.sphere()->radius_mm);
    press.contact = options.depth_mm ? law.at_depth(input.depth_mm) : law.at_force(input.force_mN);
  } else {
    press = TipContact(indenter, skin).press(input);
  }
  if (indenter.sphere() != nullptr && options.force_N &&
      press.contact.depth_mm > indenter.sphere()->radius_mm) {
    return bad_input("--force-N " + shortest_decimal(*options.force_N) + " would need a depth of " +
                     shortest_decimal(press.contact.depth_mm) +
                     " mm, more than the sphere's radius: no contact law reaches that far; give a "
                     "smaller force or a larger --radius-mm");
  }
  return InspectedPress{skin, indenter, press};
}

namespace {

/// A solved contact on its pixels: x, y, gap, pressure, energy density.
using SolvedPixels = std::vector<std::array<double, 5>>;

/// The pixels around a solved tip.
SolvedPixels pixels_of(const InspectedPress& inspected, const TipField& field) {
  const ContactState& contact = inspected.press.contact;
  const SkinMaterial skin(inspected.skin);
  const PressTables& press = field.tables();
  const TipHeight gap = pressed_tip(inspected.indenter, inspected.skin).gap;
  // Twice as wide as the contact, in whole pixels around its middle.
  PixelGrid shown = press.contact.grid;
  shown.columns += 2 * (shown.columns / 2);
  shown.rows += 2 * (shown.rows / 2);
  const std::size_t beside = (shown.columns - press.contact.grid.columns) / 2;
  const std::size_t before = (shown.rows - press.contact.grid.rows) / 2;
  SolvedPixels pixels;
  for (std::size_t row = 0; row < shown.rows; ++row) {
    for (std::size_t column = 0; column < shown.columns; ++column) {
      const double x = press.contact.middle.x_mm + shown.x_mm(column);
      const double y = press.contact.middle.y_mm + shown.y_mm(row);
      const bool inside = column >= beside && column - beside < press.contact.grid.columns &&
                          row >= before && row - before < press.contact.grid.rows;
      const double pressure =
          inside ? press.pressure_kPa[(row - before) * press.contact.grid.columns + column - beside]
                 : 0.0;
      const CartesianStress stress = field.at(x, y, contact.depth_mm).stress;
      pixels.push_back(
          {x, y, gap(x, y), contact.stiffening * pressure,
           contact.stiffening * energy_density_kPa(stress, skin, inspected.skin.energy_density)});
    }
  }
  return pixels;
}

/// The pixels of a surface.
SolvedPixels pixels_of(const InspectedPress& inspected, const SlidingContact& surface) {
  const PixelGrid& grid = surface.gap().grid;
  const Position first = surface.first_pixel();
  const double stiffening = inspected.press.contact.stiffening;
  SolvedPixels pixels;
  for (std::size_t row = 0; row < grid.rows; ++row) {
    for (std::size_t column = 0; column < grid.columns; ++column) {
      const std::size_t at = row * grid.columns + column;
      const double x = first.x_mm + grid.pixel_mm * static_cast<double>(column);
      const double y = first.y_mm + grid.pixel_mm * static_cast<double>(row);
      pixels.push_back({x, y, surface.gap().height_mm[at],
                        stiffening * surface.solver().pressure_kPa()[at],
                        stiffening * surface.energy_kPa(x, y)});
    }
  }
  return pixels;
}

/// Writes a solved contact as a table and draws it.
Expected<void, SetupError> draw(const SolvedPixels& pixels, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return bad_input("cannot make the folder " + folder + ": " + error.message());
  auto table =
      CsvTable::create(folder + "/contact.csv", "x_mm,y_mm,gap_mm,pressure_kPa,sed_kPa", true);
  if (!table) return Unexpected<SetupError>(table.error());
  for (const auto& [x, y, gap, pressure, energy] : pixels)
    table->row({x, y, gap, pressure, energy});
  if (auto closed = table->close(); !closed) return closed;
  return draw_plots("contact", folder);
}

void print_press(double depth_mm, double force_mN, double area_mm2, double pressure_kPa,
                 double energy_kPa, double pixel_mm) {
  std::printf("%.12g,%.6g,%.6g,%.6g,%.6g,%.6g\n", depth_mm, units::N_from_mN(force_mN), area_mm2,
              pressure_kPa, energy_kPa, pixel_mm);
}

/// Prints what the solver finds at the depth of a press, or at all depths of the scene's tables.
int print_solved(const InspectedPress& inspected, const std::string& folder) {
  const ContactState& contact = inspected.press.contact;
  const bool one = contact.depth_mm > 0.0;
  SolvedPixels pixels;
  std::printf("depth_mm,force_N,contact_mm2,peak_pressure_kPa,largest_sed_kPa,pixel_mm\n");
  if (inspected.indenter.surface.slides) {
    const auto surface = settled(inspected, inspected.skin);
    pixels = pixels_of(inspected, *surface);
    double largest_kPa = 0.0;
    for (const auto& pixel : pixels) largest_kPa = std::max(largest_kPa, pixel[4]);
    const RigidContact::Solution found = surface->solver().solution();
    print_press(contact.depth_mm, contact.force_mN, found.area_mm2,
                contact.stiffening * found.peak_pressure_kPa, largest_kPa,
                surface->gap().grid.pixel_mm);
  } else {
    const TipField field = one ? TipField(inspected.indenter, inspected.skin, contact.depth_mm)
                               : TipField(inspected.indenter, inspected.skin);
    for (const PressTables::Table& table : field.tables().tables) {
      if (!(table.depth_mm > 0.0)) continue;
      const double rest_mN = table.force_mN_per_mm * table.depth_mm;
      const double stiffening =
          inspected.skin.stiffening_at(table.depth_mm, rest_mN / table.area_mm2);
      print_press(table.depth_mm, stiffening * rest_mN, table.area_mm2,
                  stiffening * table.peak_pressure_kPa,
                  stiffening * field.largest_energy_kPa(table.depth_mm),
                  field.tables().contact.grid.pixel_mm);
    }
    std::fprintf(stderr, "%s\n",
                 contact_sentence(contact, inspected.indenter, inspected.skin).c_str());
    if (one && !folder.empty()) pixels = pixels_of(inspected, field);
  }
  if (folder.empty()) return kDone;
  if (!one) return refuse("to draw a contact, give --depth-mm or --force-N");
  if (const auto drawn = draw(pixels, folder); !drawn) return refuse(drawn.error());
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
        "--draw is for solved contacts: all tips but a sphere, or skin on bone or with [[skin.layer]]");
  }
  const ContactValidity validity =
      validity_of(contact, inspected->skin, inspected->indenter.sphere()->radius_mm);
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

}  // namespace merkel
