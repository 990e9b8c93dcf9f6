#include "core/contact/taxel_field.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/contact/taxel_stress.hpp"
#include "core/math/cubic_interpolation.hpp"

namespace merkel {
namespace {

constexpr double kTaxelNodesPerDepth = 3.0;
constexpr double kMargin_mm = 12.0;
constexpr double kError = 5e-5;  ///< of the stress, beside the largest one under a taxel
constexpr double kTouched = 0.05;
constexpr double kFarGrowth = 1.12;  ///< of the distances between checked offsets, far away

std::size_t padded(std::size_t count, std::size_t to) { return (count + to - 1) / to * to; }

Position in_array(const Position& at, const Position& middle, double orientation_deg) {
  const double angle = orientation_deg * std::numbers::pi / 180.0;
  const double x = at.x_mm - middle.x_mm;
  const double y = at.y_mm - middle.y_mm;
  return {.x_mm = std::cos(angle) * x + std::sin(angle) * y,
          .y_mm = std::cos(angle) * y - std::sin(angle) * x};
}

struct Box {
  double left = HUGE_VAL, right = -HUGE_VAL, bottom = HUGE_VAL, top = -HUGE_VAL;
  void add(const Position& at) noexcept {
    left = std::min(left, at.x_mm);
    right = std::max(right, at.x_mm);
    bottom = std::min(bottom, at.y_mm);
    top = std::max(top, at.y_mm);
  }
};

/// Different values, in order, and the place of each value among them.
std::vector<double> different(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}
std::uint32_t place_among(const std::vector<double>& values, double value) {
  return static_cast<std::uint32_t>(std::lower_bound(values.begin(), values.end(), value) -
                                    values.begin());
}

/// Offsets from 0 to a largest one: dense near the taxel, then growing.
std::vector<double> offsets_to(double largest_mm, double near_mm, double step_mm) {
  std::vector<double> offsets;
  double step = step_mm;
  for (double at = 0.0; at < largest_mm; at += step) {
    offsets.push_back(at);
    if (at > near_mm) step *= kFarGrowth;
  }
  offsets.push_back(largest_mm);
  return offsets;
}

}  // namespace

TaxelField::Grid TaxelField::grid_of(const TaxelArray& array, double orientation_deg,
                                     const SkinParameters& skin,
                                     std::span<const Position> receptors) {
  const bool disc = array.shape == TaxelArray::Shape::kDisc;
  const double half_width = 0.5 * array.width_mm;
  const double half_length = disc ? half_width : 0.5 * array.length_mm;
  const std::vector<Position> centres = array.centres();
  Box reach;
  for (const Position& centre : centres) reach.add(centre);
  reach = {.left = reach.left - kMargin_mm - half_width,
           .right = reach.right + kMargin_mm + half_width,
           .bottom = reach.bottom - kMargin_mm - half_length,
           .top = reach.top + kMargin_mm + half_length};
  Box box = {reach.right, reach.left, reach.top, reach.bottom};
  for (const Position& receptor : receptors) {
    box.add(in_array(receptor, array.place, orientation_deg));
  }
  Grid grid{.spacing_mm = skin.receptor_depth_mm / kTaxelNodesPerDepth};
  const double edge = 1.5 * grid.spacing_mm;  // cubics need a node more on each side
  grid.left_mm = std::max(reach.left, box.left) - edge;
  grid.bottom_mm = std::max(reach.bottom, box.bottom) - edge;
  const auto count = [&](double from, double to) {
    return static_cast<std::size_t>(std::ceil(std::max(0.0, to + edge - from) / grid.spacing_mm)) +
           1;
  };
  grid.columns = padded(count(grid.left_mm, std::min(reach.right, box.right)), kProductRows);
  grid.rows = padded(count(grid.bottom_mm, std::min(reach.top, box.top)), kProductColumns);
  return grid;
}

std::size_t TaxelField::nodes(const TaxelArray& array, double orientation_deg,
                              const SkinParameters& skin, std::span<const Position> receptors) {
  const Grid grid = grid_of(array, orientation_deg, skin, receptors);
  return grid.columns * grid.rows;
}

TaxelField::TaxelField(const TaxelArray& array, double orientation_deg, const SkinParameters& skin,
                       std::span<const Position> receptors)
    : grid_(grid_of(array, orientation_deg, skin, receptors)),
      area_of_taxel_mm2_(array.area_mm2()),
      least_kPa_(array.least_kPa),
      place_(array.place),
      along_(in_array({1.0, 0.0}, {}, -orientation_deg)) {
  const std::size_t nodes = grid_.columns * grid_.rows;
  const SkinMaterial material(skin);
  nodes_.distortional = static_cast<float>(1.0 / (12.0 * material.shear_modulus_kPa()));
  nodes_.volumetric = skin.energy_density == EnergyDensity::kFull
                          ? static_cast<float>(1.0 / (18.0 * material.bulk_modulus_kPa()))
                          : 0.0F;
  for (std::size_t s = 0; s < kStresses; ++s) {
    stress_[s] = AlignedArray<float>(nodes);
    nodes_.of[s] = stress_[s].data();
  }
  node_energies_ = AlignedArray<float>(nodes);
  place_taxels(array);
  fill_factors(array, skin);
  place_receptors(receptors, array, orientation_deg);
}

void TaxelField::place_taxels(const TaxelArray& array) {
  const std::vector<Position> centres = array.centres();
  for (const Position& centre : centres) {
    x_mm_.push_back(centre.x_mm);
    y_mm_.push_back(centre.y_mm);
  }
  x_mm_ = different(std::move(x_mm_));
  y_mm_ = different(std::move(y_mm_));
  columns_ = padded(x_mm_.size(), kProductRows);
  rows_ = y_mm_.size();
  for (const Position& centre : centres) {
    taxels_.push_back({place_among(x_mm_, centre.x_mm), place_among(y_mm_, centre.y_mm)});
  }
  pressures_.assign(taxels_.size(), 0.0F);
  by_column_ = AlignedArray<float>(columns_ * rows_);
  rows_in_use_.reserve(rows_);
}

void TaxelField::fill_factors(const TaxelArray& array, const SkinParameters& skin) {
  const auto node_x = [&](std::size_t i) {
    return grid_.left_mm + grid_.spacing_mm * static_cast<double>(i);
  };
  const auto node_y = [&](std::size_t j) {
    return grid_.bottom_mm + grid_.spacing_mm * static_cast<double>(j);
  };
  const double farthest_x = std::max(std::fabs(x_mm_.back() - grid_.left_mm),
                                     std::fabs(node_x(grid_.columns) - x_mm_.front()));
  const double farthest_y = std::max(std::fabs(y_mm_.back() - grid_.bottom_mm),
                                     std::fabs(node_y(grid_.rows) - y_mm_.front()));
  const TaxelStress stress(array, skin, std::hypot(farthest_x, farthest_y));
  const double step = 0.25 * skin.receptor_depth_mm;
  const auto near = [&](double size) { return 0.5 * size + 2.0 * skin.receptor_depth_mm; };
  const auto offsets_x = offsets_to(farthest_x, near(array.width_mm), step);
  const auto offsets_y = offsets_to(farthest_y, near(array.length_mm), step);
  double largest = 0.0;
  for (const double value : stress.at(0.0, 0.0)) largest = std::max(largest, std::fabs(value));
  for (std::size_t s = 0; s < kStresses; ++s) {
    const SeparableStress separable(stress, s, offsets_x, offsets_y, kError * largest);
    Factors& factors = factors_[s];
    factors.terms = separable.terms();
    most_terms_ = std::max(most_terms_, factors.terms);
    factors.along_x = AlignedArray<float>(factors.terms * columns_ * grid_.columns);
    factors.along_y = AlignedArray<float>(factors.terms * rows_ * grid_.rows);
    for (std::size_t c = 0; c < x_mm_.size(); ++c) {
      for (std::size_t i = 0; i < grid_.columns; ++i) {
        const std::vector<double> u = separable.along_x(node_x(i) - x_mm_[c]);
        const std::size_t block = i / kProductRows;
        for (std::size_t t = 0; t < factors.terms; ++t) {
          const std::size_t at = (block * factors.terms + t) * columns_ + c;
          factors.along_x[at * kProductRows + i % kProductRows] = static_cast<float>(u[t]);
        }
      }
    }
    for (std::size_t r = 0; r < rows_; ++r) {
      for (std::size_t j = 0; j < grid_.rows; ++j) {
        const std::vector<double> v = separable.along_y(node_y(j) - y_mm_[r]);
        for (std::size_t t = 0; t < factors.terms; ++t) {
          factors.along_y[(t * rows_ + r) * grid_.rows + j] = static_cast<float>(v[t]);
        }
      }
    }
  }
  sums_ = AlignedArray<float>(most_terms_ * columns_ * grid_.rows);
  sums_in_use_.reserve(most_terms_ * columns_);
}

void TaxelField::place_receptors(std::span<const Position> receptors, const TaxelArray& array,
                                 double orientation_deg) {
  for (const Position& receptor : receptors) {
    const Position at = in_array(receptor, array.place, orientation_deg);
    const double column = (at.x_mm - grid_.left_mm) / grid_.spacing_mm;
    const double row = (at.y_mm - grid_.bottom_mm) / grid_.spacing_mm;
    GridPoint& point = points_.emplace_back();
    if (!(column >= 1.0 && column < static_cast<double>(grid_.columns - 2) && row >= 1.0 &&
          row < static_cast<double>(grid_.rows - 2))) {
      continue;
    }
    const auto i = static_cast<std::size_t>(column);
    const auto j = static_cast<std::size_t>(row);
    const auto along_x = cubic_weights(column - static_cast<double>(i));
    const auto along_y = cubic_weights(row - static_cast<double>(j));
    for (std::size_t k = 0; k < 4; ++k) {
      point.along_x[k] = static_cast<float>(along_x[k]);
      point.along_y[k] = static_cast<float>(along_y[k]);
    }
    point.first = (i - 1) * grid_.rows + (j - 1);
  }
  energies_.assign(points_.size(), 0.0F);
}

/// One component of the stress at all nodes: over the taxels of each column, then over the columns.
void TaxelField::add_up(std::size_t stress) noexcept {
  const Factors& factors = factors_[stress];
  for (std::size_t t = 0; t < factors.terms; ++t) {
    for (std::size_t block = 0; block < columns_; block += kProductRows) {
      multiply({.factors = by_column_.data() + block * rows_,
                .rows = factors.along_y.data() + t * rows_ * grid_.rows,
                .terms = rows_in_use_,
                .columns = grid_.rows,
                .out = sums_.data() + (t * columns_ + block) * grid_.rows});
    }
  }
  const std::size_t products = factors.terms * columns_;
  const auto used = std::lower_bound(sums_in_use_.begin(), sums_in_use_.end(), products);
  const std::span<const std::uint32_t> terms(sums_in_use_.data(),
                                             static_cast<std::size_t>(used - sums_in_use_.begin()));
  for (std::size_t block = 0; block < grid_.columns; block += kProductRows) {
    multiply({.factors = factors.along_x.data() + block * products,
              .rows = sums_.data(),
              .terms = terms,
              .columns = grid_.rows,
              .out = stress_[stress].data() + block * grid_.rows});
  }
}

void TaxelField::release() noexcept {
  if (!touching()) return;
  ++version_;
  force_mN_ = peak_kPa_ = area_mm2_ = 0.0;
  std::fill(pressures_.begin(), pressures_.end(), 0.0F);
  std::fill(energies_.begin(), energies_.end(), 0.0F);
}

void TaxelField::press(std::span<const float> pressures_kPa) noexcept {
  assert(pressures_kPa.size() == taxels_.size());
  bool changed = false;
  for (std::size_t i = 0; i < taxels_.size(); ++i) {
    const float given = pressures_kPa[i];
    const float pressure = given > 0.0F && static_cast<double>(given) >= least_kPa_ ? given : 0.0F;
    changed = changed || pressure != pressures_[i];
    pressures_[i] = pressure;
  }
  if (!changed) return;
  ++version_;
  force_mN_ = peak_kPa_ = area_mm2_ = 0.0;
  for (const float pressure : pressures_) {
    force_mN_ += static_cast<double>(pressure) * area_of_taxel_mm2_;
    peak_kPa_ = std::max(peak_kPa_, static_cast<double>(pressure));
  }
  if (!touching()) {
    std::fill(energies_.begin(), energies_.end(), 0.0F);
    return;
  }
  double x_kPa_mm = 0.0;
  double y_kPa_mm = 0.0;
  std::fill(by_column_.begin(), by_column_.end(), 0.0F);
  rows_in_use_.assign(rows_, 0);
  sums_in_use_.assign(columns_, 0);
  for (std::size_t i = 0; i < taxels_.size(); ++i) {
    if (!(pressures_[i] > 0.0F)) continue;
    if (static_cast<double>(pressures_[i]) >= kTouched * peak_kPa_) area_mm2_ += area_of_taxel_mm2_;
    const auto [column, row] = taxels_[i];
    x_kPa_mm += static_cast<double>(pressures_[i]) * x_mm_[column];
    y_kPa_mm += static_cast<double>(pressures_[i]) * y_mm_[row];
    const std::size_t block = column / kProductRows;
    by_column_[(block * rows_ + row) * kProductRows + column % kProductRows] = pressures_[i];
    rows_in_use_[row] = 1;
    sums_in_use_[column] = 1;
  }
  const double per_sum = area_of_taxel_mm2_ / force_mN_;
  centre_ = {.x_mm = place_.x_mm + per_sum * (along_.x_mm * x_kPa_mm - along_.y_mm * y_kPa_mm),
             .y_mm = place_.y_mm + per_sum * (along_.y_mm * x_kPa_mm + along_.x_mm * y_kPa_mm)};
  // The numbers of the rows and columns with pressure, in place of their marks.
  const auto numbers = [](std::vector<std::uint32_t>& marks) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < marks.size(); ++i) {
      if (marks[i] != 0) marks[count++] = static_cast<std::uint32_t>(i);
    }
    marks.resize(count);
  };
  numbers(rows_in_use_);
  numbers(sums_in_use_);
  const std::size_t used_columns = sums_in_use_.size();
  for (std::size_t t = 1; t < most_terms_; ++t) {
    for (std::size_t k = 0; k < used_columns; ++k) {
      sums_in_use_.push_back(static_cast<std::uint32_t>(t * columns_) + sums_in_use_[k]);
    }
  }
  for (std::size_t s = 0; s < kStresses; ++s) add_up(s);
  node_energies(nodes_, grid_.columns * grid_.rows, node_energies_.data());
  interpolate_points(points_, node_energies_.data(), grid_.rows, energies_.data());
}

}  // namespace merkel
