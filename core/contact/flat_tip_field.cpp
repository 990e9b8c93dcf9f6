#include "core/contact/flat_tip_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/contact/bar_press.hpp"
#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/math/cubic_interpolation.hpp"
#include "core/skin/point_load.hpp"

namespace merkel {
namespace {

constexpr double kMargin_mm = 10.0;
constexpr double kCurvedMargin_mm = 6.0;
constexpr std::size_t kDepths = 14;  ///< number of tables on a curved finger
constexpr int kIncrements = 1;       ///< of a press, between two tables
constexpr double kDeepestTable_mm = 4.0;

double grid_spacing_mm(double receptor_depth_mm, double parts) {
  return std::clamp(receptor_depth_mm / parts, 0.02, 0.2);
}

/// Number of grid nodes of a tip; the grid covers half of the tip along y.
double grid_nodes(double width_mm, double length_mm, const SkinParameters& skin) {
  const double spacing = grid_spacing_mm(skin.receptor_depth_mm, 8.0);
  const double grids = std::isinf(skin.radius_mm) ? 1.0 : static_cast<double>(kDepths + 2);
  return grids * (width_mm + 2.0 * kMargin_mm) / spacing * (0.5 * length_mm + kMargin_mm) / spacing;
}
constexpr double kMostNodes = 4e6;
constexpr double kMostSuperposed = 4e8;

GridNode pack(const FlatTipField::Values& values) {
  const CartesianStress& s = values.stress;
  return {{s.sigma_x, s.sigma_y, s.sigma_z, s.tau_xy, s.tau_yz, s.tau_zx, values.displacement}};
}

}  // namespace

bool FlatTipField::fits(const BarTip& tip, const SkinParameters& skin) noexcept {
  const double nodes = grid_nodes(tip.total_width_mm(), tip.length_mm, skin);
  return nodes <= kMostNodes &&
         nodes * static_cast<double>(tip.loads(skin.receptor_depth_mm)) <= kMostSuperposed;
}

bool FlatTipField::fits(const PinTip& tip, const SkinParameters& skin) noexcept {
  return grid_nodes(tip.diameter_mm, tip.diameter_mm, skin) <= kMostNodes;
}

FlatTipField::FlatTipField(const BarTip& tip, const SkinParameters& skin)
    : skin_(skin),
      receptor_depth_mm_(skin.receptor_depth_mm),
      round_(false),
      half_diagonal_mm_(0.5 * std::hypot(tip.total_width_mm(), tip.length_mm)),
      spacing_mm_(grid_spacing_mm(skin.receptor_depth_mm, std::isinf(skin.radius_mm) ? 8.0 : 6.0)) {
  if (std::isfinite(skin.radius_mm)) {
    fill_curved(tip, skin);
    return;
  }
  lay_grid(0.5 * tip.total_width_mm(), 0.5 * tip.length_mm, kMargin_mm);
  const BarContact contact =
      BarContact::solve(tip, skin_.reduced_modulus_kPa(), skin.receptor_depth_mm);
  Table& table = tables_.emplace_back();
  table.force_mN_per_mm = contact.force_mN_per_mm;
  fill(table, [&](double x, double y) { return superposed(contact, x, y); });
}

FlatTipField::FlatTipField(const PinTip& tip, const SkinParameters& skin)
    : skin_(skin),
      receptor_depth_mm_(skin.receptor_depth_mm),
      round_(true),
      half_diagonal_mm_(0.5 * tip.diameter_mm),
      spacing_mm_(grid_spacing_mm(skin.receptor_depth_mm, 8.0)) {
  const double radius = 0.5 * tip.diameter_mm;
  lay_grid(radius, radius, kMargin_mm);
  if (std::isfinite(skin.radius_mm)) fill_curved(tip, skin);
  Table& table = tables_.emplace_back();
  table.force_mN_per_mm = pin_force_mN_per_mm(tip, skin_.reduced_modulus_kPa());
  fill(table, [&](double x, double y) {
    const double r = std::hypot(x, y);
    const AxisymmetricStress stress =
        pin_stress(table.force_mN_per_mm, radius, skin_.poisson_ratio(), r, receptor_depth_mm_);
    return Values{.stress = cartesian(stress, x, y),
                  .displacement = pin_displacement_mm(1.0, radius, r)};
  });
}

void FlatTipField::fill_curved(const PinTip& tip, const SkinParameters& skin) {
  // The Hertz contact grows until it reaches the rim.
  const double plate = std::numeric_limits<double>::infinity();
  const HertzContact hertz(plate, skin.radius_mm, skin_.reduced_modulus_kPa());
  deepest_mm_ = 0.25 * tip.diameter_mm * tip.diameter_mm / skin.radius_mm;
  tables_.resize(kDepths + 1);
  tables_.front().nodes.assign(columns_ * rows_, Node{});
  for (std::size_t k = 1; k <= kDepths; ++k) {
    const double s = static_cast<double>(k) / kDepths;
    const ContactState contact = hertz.at_depth(s * s * deepest_mm_);
    tables_[k].force_mN_per_mm = contact.force_mN / contact.depth_mm;
    fill(tables_[k], [&](double x, double y) {
      const double r = std::hypot(x, y);
      const AxisymmetricStress stress =
          huber_stress(contact, skin_.poisson_ratio(), r, receptor_depth_mm_);
      return Values{
          .stress = cartesian(stress, x, y) * (1.0 / contact.depth_mm),
          .displacement = HertzContact::surface_displacement_mm(contact, r) / contact.depth_mm};
    });
  }
}

void FlatTipField::fill_curved(const BarTip& tip, const SkinParameters& skin) {
  const double modulus = skin_.reduced_modulus_kPa();
  deepest_mm_ = std::min(kDeepestTable_mm, whole_length_depth_mm(tip, skin.radius_mm));
  lay_grid(0.5 * tip.total_width_mm(),
           0.5 * touching_part(tip, skin.radius_mm, deepest_mm_).length_mm, kCurvedMargin_mm);
  const auto contact_at = [&](double depth_mm) {
    return BarContact::solve(touching_part(tip, skin.radius_mm, depth_mm), modulus,
                             receptor_depth_mm_);
  };
  tables_.resize(kDepths + 2);
  tables_.front().nodes.assign(columns_ * rows_, Node{});
  Table sum;
  sum.nodes.assign(columns_ * rows_, Node{});
  double before_mm = 0.0;
  for (std::size_t k = 1; k <= kDepths; ++k) {
    const double s = static_cast<double>(k) / kDepths;
    const double depth_mm = s * s * deepest_mm_;
    for (const QuadratureNode& part : press_increments(before_mm, depth_mm, kIncrements)) {
      const BarContact contact = contact_at(part.x);
      Table own;
      fill(own, [&](double x, double y) { return superposed(contact, x, y); });
      sum.force_mN_per_mm += part.weight * contact.force_mN_per_mm;
      for (std::size_t i = 0; i < own.nodes.size(); ++i) {
        for (std::size_t f = 0; f < Node::kFields; ++f) {
          sum.nodes[i].values[f] += part.weight * own.nodes[i].values[f];
        }
      }
    }
    Table& table = tables_[k];
    table.force_mN_per_mm = sum.force_mN_per_mm / depth_mm;
    table.nodes = sum.nodes;
    for (Node& node : table.nodes) {
      for (double& value : node.values) value /= depth_mm;
    }
    before_mm = depth_mm;
  }
  const BarContact contact = contact_at(deepest_mm_);
  tables_.back().force_mN_per_mm = contact.force_mN_per_mm;
  fill(tables_.back(), [&](double x, double y) { return superposed(contact, x, y); });
}

void FlatTipField::lay_grid(double half_width_mm, double half_length_mm, double margin_mm) {
  const double half_x = half_width_mm + margin_mm;
  const double half_y = half_length_mm + margin_mm;
  const auto half_columns = static_cast<std::size_t>(std::ceil(half_x / spacing_mm_)) + 2;
  columns_ = 2 * half_columns + 1;
  rows_ = static_cast<std::size_t>(std::ceil(half_y / spacing_mm_)) + 4;
  first_x_mm_ = -static_cast<double>(half_columns) * spacing_mm_;
}

template <class Field>
void FlatTipField::fill(Table& table, Field field) const {
  table.nodes.reserve(columns_ * rows_);
  for (std::size_t row = 0; row < rows_; ++row) {
    const double y = (static_cast<double>(row) - 1.0) * spacing_mm_;
    for (std::size_t column = 0; column < columns_; ++column) {
      const double x = first_x_mm_ + static_cast<double>(column) * spacing_mm_;
      table.nodes.push_back(pack(field(x, y)));
    }
  }
}

FlatTipField::Values FlatTipField::superposed(const BarContact& contact, double x_mm,
                                              double y_mm) const noexcept {
  Values values;
  for (const LineLoad& load : contact.loads) {
    values.stress += line_load_stress(load, skin_.poisson_ratio(), x_mm, y_mm, receptor_depth_mm_);
    // A load represents a strip, whose finite width keeps the sum finite directly above it.
    const double apart = std::max(std::fabs(x_mm - load.x_mm), 1e-3);
    values.displacement +=
        line_load_displacement_mm(load, skin_.reduced_modulus_kPa(), load.x_mm + apart, y_mm);
  }
  return values;
}

FlatTipField::Blend FlatTipField::blend(double depth_mm) const noexcept {
  const double depth = std::max(0.0, depth_mm);
  if (tables_.size() == 1) return {{&tables_[0], &tables_[0]}, {depth, 0.0}};
  if (depth >= deepest_mm_) {
    return {{&tables_[kDepths], &tables_.back()}, {deepest_mm_, depth - deepest_mm_}};
  }
  const double place = kDepths * std::sqrt(depth / deepest_mm_);
  const auto below = std::min(static_cast<std::size_t>(place), kDepths - 1);
  const double part = place - static_cast<double>(below);
  return {{&tables_[below], &tables_[below + 1]}, {(1.0 - part) * depth, part * depth}};
}

double FlatTipField::force_mN(double depth_mm) const noexcept {
  const Blend at = blend(depth_mm);
  return at.weight[0] * at.table[0]->force_mN_per_mm + at.weight[1] * at.table[1]->force_mN_per_mm;
}

double FlatTipField::depth_mm(double force_mN_wanted) const noexcept {
  if (!(force_mN_wanted > 0.0)) return 0.0;
  // Every table except the empty first one has at least this force.
  const Table& last = tables_.back();
  if (tables_.size() == 1) return force_mN_wanted / last.force_mN_per_mm;
  double low = 0.0;
  double high = deepest_mm_ + force_mN_wanted / last.force_mN_per_mm;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    (force_mN(middle) < force_mN_wanted ? low : high) = middle;
  }
  return high;
}

double FlatTipField::far_displacement_mm2(double depth_mm) const noexcept {
  return force_mN(depth_mm) / (std::numbers::pi * skin_.reduced_modulus_kPa());
}

FlatTipField::Values FlatTipField::far_away(double force_mN, double x_mm,
                                            double y_mm) const noexcept {
  const double r = std::hypot(x_mm, y_mm);
  return {
      .stress = cartesian(point_load_stress(force_mN, skin_.poisson_ratio(), r, receptor_depth_mm_),
                          x_mm, y_mm),
      .displacement = force_mN / (std::numbers::pi * skin_.reduced_modulus_kPa()) / r};
}

FlatTipField::Values FlatTipField::at(double x_mm, double y_mm, double depth_mm) const noexcept {
  // The field is even in y, except the two shear stresses with index y.
  const double column = (x_mm - first_x_mm_) / spacing_mm_;
  const double row = std::fabs(y_mm) / spacing_mm_ + 1.0;
  if (!(column >= 1.0 && column < static_cast<double>(columns_ - 2) &&
        row < static_cast<double>(rows_ - 2))) {
    return far_away(force_mN(depth_mm), x_mm, y_mm);
  }
  const auto i = static_cast<std::size_t>(column);
  const auto j = static_cast<std::size_t>(row);
  const Blend blended = blend(depth_mm);
  GridPatch patch{.columns = columns_,
                  .along_x = cubic_weights(column - static_cast<double>(i)),
                  .along_y = cubic_weights(row - static_cast<double>(j))};
  for (std::size_t t = 0; t < 2; ++t) {
    if (blended.weight[t] == 0.0) continue;
    patch.corner[t] = blended.table[t]->nodes.data() + (j - 1) * columns_ + (i - 1);
    patch.weight[t] = blended.weight[t];
  }
  const auto total = interpolate(patch).values;
  const double sign = y_mm < 0.0 ? -1.0 : 1.0;
  return {.stress = {.sigma_x = total[0],
                     .sigma_y = total[1],
                     .sigma_z = total[2],
                     .tau_xy = sign * total[3],
                     .tau_yz = sign * total[4],
                     .tau_zx = total[5]},
          .displacement = total[6]};
}

}  // namespace merkel
