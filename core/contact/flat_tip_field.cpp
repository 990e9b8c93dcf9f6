#include "core/contact/flat_tip_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/skin/point_load.hpp"

namespace merkel {
namespace {

constexpr double kMargin_mm = 10.0;

double grid_spacing_mm(const SkinParameters& skin) {
  return std::clamp(skin.receptor_depth_mm / 8.0, 0.02, 0.2);
}

/// Nodes of the grid of a tip, which covers half of it along y.
double grid_nodes(double width_mm, double length_mm, const SkinParameters& skin) {
  const double spacing = grid_spacing_mm(skin);
  return (width_mm + 2.0 * kMargin_mm) / spacing * (0.5 * length_mm + kMargin_mm) / spacing;
}
constexpr double kMostNodes = 4e6;
constexpr double kMostSuperposed = 4e8;

std::array<double, 7> pack(const FlatTipField::Unit& unit) {
  const CartesianStress& s = unit.stress;
  return {s.sigma_x, s.sigma_y, s.sigma_z, s.tau_xy, s.tau_yz, s.tau_zx, unit.displacement};
}

/// The weights of the cubic through the points −1, 0, 1, 2 at t in [0, 1].
std::array<double, 4> cubic_weights(double t) {
  return {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
          -(t + 1.0) * t * (t - 2.0) / 2.0, (t + 1.0) * t * (t - 1.0) / 6.0};
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
      half_diagonal_mm_(0.5 * std::hypot(tip.total_width_mm(), tip.length_mm)),
      contact_(BarContact::solve(tip, skin_.reduced_modulus_kPa(), skin.receptor_depth_mm)),
      force_mN_per_mm_(contact_.force_mN_per_mm),
      spacing_mm_(grid_spacing_mm(skin)) {
  fill_grid(0.5 * tip.total_width_mm(), 0.5 * tip.length_mm,
            [this](double x, double y) { return superposed(x, y); });
}

FlatTipField::FlatTipField(const PinTip& tip, const SkinParameters& skin)
    : skin_(skin),
      receptor_depth_mm_(skin.receptor_depth_mm),
      half_diagonal_mm_(0.5 * tip.diameter_mm),
      force_mN_per_mm_(pin_force_mN_per_mm(tip, skin_.reduced_modulus_kPa())),
      spacing_mm_(grid_spacing_mm(skin)) {
  const double radius = 0.5 * tip.diameter_mm;
  fill_grid(radius, radius, [this, radius](double x, double y) {
    const double r = std::hypot(x, y);
    const AxisymmetricStress stress =
        pin_stress(force_mN_per_mm_, radius, skin_.poisson_ratio(), r, receptor_depth_mm_);
    return Unit{.stress = cartesian(stress, x, y),
                .displacement = pin_displacement_mm(1.0, radius, r)};
  });
}

template <class Field>
void FlatTipField::fill_grid(double half_width_mm, double half_length_mm, Field field) {
  const double half_x = half_width_mm + kMargin_mm;
  const double half_y = half_length_mm + kMargin_mm;
  const auto half_columns = static_cast<std::size_t>(std::ceil(half_x / spacing_mm_)) + 2;
  columns_ = 2 * half_columns + 1;
  rows_ = static_cast<std::size_t>(std::ceil(half_y / spacing_mm_)) + 4;
  first_x_mm_ = -static_cast<double>(half_columns) * spacing_mm_;
  nodes_.reserve(columns_ * rows_);
  for (std::size_t row = 0; row < rows_; ++row) {
    const double y = (static_cast<double>(row) - 1.0) * spacing_mm_;
    for (std::size_t column = 0; column < columns_; ++column) {
      const double x = first_x_mm_ + static_cast<double>(column) * spacing_mm_;
      nodes_.push_back(pack(field(x, y)));
    }
  }
}

FlatTipField::Unit FlatTipField::superposed(double x_mm, double y_mm) const noexcept {
  Unit unit;
  for (const LineLoad& load : contact_.loads) {
    unit.stress += line_load_stress(load, skin_.poisson_ratio(), x_mm, y_mm, receptor_depth_mm_);
    // A load stands for a strip: on top of it, the strip's finite width keeps the sum finite.
    const double apart = std::max(std::fabs(x_mm - load.x_mm), 1e-3);
    unit.displacement +=
        line_load_displacement_mm(load, skin_.reduced_modulus_kPa(), load.x_mm + apart, y_mm);
  }
  return unit;
}

double FlatTipField::far_displacement_mm() const noexcept {
  return force_mN_per_mm_ / (std::numbers::pi * skin_.reduced_modulus_kPa());
}

FlatTipField::Unit FlatTipField::far_away(double x_mm, double y_mm) const noexcept {
  const double r = std::hypot(x_mm, y_mm);
  return {.stress = cartesian(
              point_load_stress(force_mN_per_mm_, skin_.poisson_ratio(), r, receptor_depth_mm_),
              x_mm, y_mm),
          .displacement = far_displacement_mm() / r};
}

FlatTipField::Unit FlatTipField::at(double x_mm, double y_mm) const noexcept {
  // The field is even in y, but for the two shear stresses that end there.
  const double column = (x_mm - first_x_mm_) / spacing_mm_;
  const double row = std::fabs(y_mm) / spacing_mm_ + 1.0;
  if (!(column >= 1.0 && column < static_cast<double>(columns_ - 2) &&
        row < static_cast<double>(rows_ - 2))) {
    return far_away(x_mm, y_mm);
  }
  const auto i = static_cast<std::size_t>(column);
  const auto j = static_cast<std::size_t>(row);
  const auto along_x = cubic_weights(column - static_cast<double>(i));
  const auto along_y = cubic_weights(row - static_cast<double>(j));
  Node sum{};
  for (std::size_t b = 0; b < 4; ++b) {
    for (std::size_t a = 0; a < 4; ++a) {
      const Node& node = nodes_[(j + b - 1) * columns_ + (i + a - 1)];
      const double weight = along_x[a] * along_y[b];
      for (std::size_t f = 0; f < kFields; ++f) sum[f] += weight * node[f];
    }
  }
  const double sign = y_mm < 0.0 ? -1.0 : 1.0;
  return {.stress = {.sigma_x = sum[0],
                     .sigma_y = sum[1],
                     .sigma_z = sum[2],
                     .tau_xy = sign * sum[3],
                     .tau_yz = sign * sum[4],
                     .tau_zx = sum[5]},
          .displacement = sum[6]};
}

}  // namespace merkel
