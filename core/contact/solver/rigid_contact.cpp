#include "core/contact/solver/rigid_contact.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/contact/solver/tip_heights.hpp"

namespace merkel {
namespace {

/// How far a flat rim acts inside the outermost pixel's border, in pixels.
constexpr double kRimShift = 0.17453;
/// Extra compliance of a rim pixel of half coverage, in pixels over E*.
constexpr double kRimCompliance = 1.72164;
/// Pixels that are covered less are left out; those that are covered more are whole.
constexpr double kMinCoverage = 0.01;

/// How far the tip may reach into skin that carries nothing, in tolerances of the gap.
constexpr double kReachTolerance = 10.0;
/// The displacement is computed anew after this many iterations, against rounding.
constexpr int kRefreshed = 32;
/// Only the displacement of the surface is used, which needs no depth.
constexpr double kAnyDepth_mm = 0.65;

GridSpectrum surface_kernel(const LayeredMedium& medium, const PixelGrid& grid) {
  return PixelKernels(medium, kAnyDepth_mm, grid, grid).kernel(PixelField::kDisplacement);
}

bool bare(const HeightMap& map, std::size_t pixel) {
  return std::isinf(map.height_mm[pixel]) || map.coverage[pixel] < kMinCoverage;
}

/// Whether the tip ends, or drops, at one of the borders of a pixel inside the grid.
bool beside_drop(const HeightMap& map, std::size_t column, std::size_t row) {
  const std::size_t columns = map.grid.columns;
  const std::size_t here = row * columns + column;
  const auto drops_to = [&](std::size_t beside) {
    return bare(map, beside) ||
           map.height_mm[beside] - map.height_mm[here] > kRimRise * map.grid.pixel_mm;
  };
  return (column > 0 && drops_to(here - 1)) || (column + 1 < columns && drops_to(here + 1)) ||
         (row > 0 && drops_to(here - columns)) ||
         (row + 1 < map.grid.rows && drops_to(here + columns));
}

/// From the middle of a pixel at the rim of a smooth contact to the end of the contact, in pixels:
/// the pressure grows with the root of the distance from there.
double end_of_contact(double rim_pressure, double next_pressure) {
  if (!(next_pressure > rim_pressure)) return 0.5;
  const double square = rim_pressure * rim_pressure;
  return std::min(1.0, square / (next_pressure * next_pressure - square));
}

}  // namespace

RigidContact::RigidContact(const LayeredMedium& medium, const HeightMap& gap)
    : grid_(gap.grid),
      modulus_kPa_(medium.reduced_modulus_kPa()),
      transform_(padded_pixels(2 * gap.grid.columns - 1), padded_pixels(2 * gap.grid.rows - 1)),
      kernel_(surface_kernel(medium, gap.grid)),
      spectrum_(transform_.make_spectrum()) {
  for (auto* const values : {&gap_, &compliance_, &covered_, &pressure_, &displaced_, &residual_,
                             &direction_, &response_}) {
    values->resize(grid_.pixels());
  }
  set_gap(gap);
}

void RigidContact::set_gap(const HeightMap& gap) noexcept {
  assert(gap.grid.columns == grid_.columns && gap.grid.rows == grid_.rows);
  for (std::size_t row = 0; row < grid_.rows; ++row) {
    for (std::size_t column = 0; column < grid_.columns; ++column) {
      const std::size_t i = row * grid_.columns + column;
      gap_[i] = bare(gap, i) ? std::numeric_limits<double>::infinity() : gap.height_mm[i];
      const bool whole = gap.coverage[i] > 1.0 - kMinCoverage;
      compliance_[i] = 0.0;
      covered_[i] = whole ? 1.0 : gap.coverage[i];
      if (!gap.rims.empty() && gap.rims[i].known) {
        compliance_[i] = gap.rims[i].compliance * grid_.pixel_mm / modulus_kPa_;
        continue;
      }
      if (bare(gap, i) || (whole && !beside_drop(gap, column, row))) continue;
      const double share = gap.coverage[i] + kRimShift;
      compliance_[i] = kRimCompliance * (1.0 / share - 1.0) * grid_.pixel_mm / modulus_kPa_;
    }
  }
}

void RigidContact::reset() noexcept { std::fill(pressure_.begin(), pressure_.end(), 0.0); }

void RigidContact::displace(std::span<const double> pressure,
                            std::span<double> displaced) noexcept {
  transform_.forward(pressure, grid_.columns, grid_.rows, spectrum_);
  transform_.convolve(spectrum_, kernel_, grid_.columns, grid_.rows, displaced);
}

RigidContact::Solution RigidContact::press(double depth_mm, const Accuracy& accuracy) noexcept {
  begin(depth_mm);
  while (!iterate(accuracy)) {
  }
  return solution();
}

void RigidContact::begin(double depth_mm) noexcept {
  solution_ = {.depth_mm = std::max(0.0, depth_mm)};
  force_mN_ = 0.0;
  if (!(depth_mm > 0.0)) reset();
  solution_.converged = !(depth_mm > 0.0) || !start(depth_mm);
}

void RigidContact::begin_with_force(double force_mN, double deepest_mm) noexcept {
  solution_ = {};
  force_mN_ = force_mN;
  if (!(force_mN > 0.0)) reset();
  solution_.converged = !(force_mN > 0.0) || !start(deepest_mm);
}

void RigidContact::move_pressure(std::ptrdiff_t columns, std::ptrdiff_t rows) noexcept {
  if (columns == 0 && rows == 0) return;
  std::copy(pressure_.begin(), pressure_.end(), response_.begin());
  const auto width = static_cast<std::ptrdiff_t>(grid_.columns);
  const auto height = static_cast<std::ptrdiff_t>(grid_.rows);
  for (std::ptrdiff_t row = 0; row < height; ++row) {
    for (std::ptrdiff_t column = 0; column < width; ++column) {
      const std::ptrdiff_t x = column + columns;
      const std::ptrdiff_t y = row + rows;
      const bool inside = x >= 0 && x < width && y >= 0 && y < height;
      pressure_[static_cast<std::size_t>(row * width + column)] =
          inside ? response_[static_cast<std::size_t>(y * width + x)] : 0.0;
    }
  }
}

double RigidContact::force_of_pressure_mN() const noexcept {
  double sum = 0.0;
  for (const double p : pressure_) sum += p;
  return sum * grid_.pixel_mm * grid_.pixel_mm;
}

double RigidContact::carry_force() noexcept {
  const double carried_mN = force_of_pressure_mN();
  if (!(carried_mN > 0.0)) return 0.0;
  const double factor = force_mN_ / carried_mN;
  for (double& p : pressure_) p *= factor;
  return factor;
}

bool RigidContact::start(double deepest_mm) noexcept {
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    if (std::isinf(gap_[i])) pressure_[i] = 0.0;
  }
  if (!(force_of_pressure_mN() > 0.0)) {
    // A cold start: everything that lies below the depth is in contact.
    for (std::size_t i = 0; i < gap_.size(); ++i) {
      pressure_[i] = gap_[i] < deepest_mm ? modulus_kPa_ : 0.0;
    }
    if (!(force_of_pressure_mN() > 0.0)) return false;
  }
  if (force_mN_ > 0.0) carry_force();
  std::fill(direction_.begin(), direction_.end(), 0.0);
  displace(pressure_, displaced_);
  change_ = Change::kGained;
  squares_before_ = 1.0;
  return true;
}

void RigidContact::update_residual() noexcept {
  double sum = 0.0;
  touching_ = 0;
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    residual_[i] = displaced_[i] + compliance_[i] * pressure_[i] - solution_.depth_mm + gap_[i];
    if (!(pressure_[i] > 0.0)) continue;
    sum += residual_[i];
    ++touching_;
  }
  if (force_mN_ > 0.0 && touching_ > 0) {
    // The depth is the one that makes the mean gap in contact zero.
    const double mean = sum / static_cast<double>(touching_);
    solution_.depth_mm += mean;
    for (double& r : residual_) r -= mean;
  }
}

void RigidContact::measure(const Accuracy& accuracy) noexcept {
  squares_ = 0.0;
  double deepest = 0.0;  // how far the tip reaches into skin that carries nothing
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    if (pressure_[i] > 0.0) {
      squares_ += residual_[i] * residual_[i];
    } else {
      deepest = std::max(deepest, -residual_[i]);
    }
  }
  const double scale = std::fabs(solution_.depth_mm);
  solution_.error = touching_ == 0 ? std::numeric_limits<double>::infinity()
                                   : std::sqrt(squares_ / static_cast<double>(touching_)) / scale;
  solution_.converged = solution_.error <= accuracy.tolerance &&
                        deepest <= kReachTolerance * accuracy.tolerance * scale;
}

double RigidContact::step_along(double kept) noexcept {
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    direction_[i] = pressure_[i] > 0.0 ? residual_[i] + kept * direction_[i] : 0.0;
  }
  displace(direction_, response_);
  double mean = 0.0;
  if (force_mN_ > 0.0 && touching_ > 0) {
    for (std::size_t i = 0; i < gap_.size(); ++i) {
      if (pressure_[i] > 0.0) mean += response_[i] + compliance_[i] * direction_[i];
    }
    mean /= static_cast<double>(touching_);
  }
  double along = 0.0;
  double stiffness = 0.0;
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    if (!(pressure_[i] > 0.0)) continue;
    along += residual_[i] * direction_[i];
    stiffness += (response_[i] + compliance_[i] * direction_[i] - mean) * direction_[i];
  }
  return stiffness > 0.0 ? along / stiffness : 0.0;
}

RigidContact::Change RigidContact::move(double step) noexcept {
  Change change = Change::kNone;
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    if (pressure_[i] > 0.0) {
      pressure_[i] -= step * direction_[i];
      if (pressure_[i] > 0.0) continue;
      pressure_[i] = 0.0;
      if (change == Change::kNone) change = Change::kLost;
    } else if (residual_[i] < 0.0) {
      pressure_[i] = -step * residual_[i];
      change = Change::kGained;
    }
  }
  return change;
}

bool RigidContact::iterate(const Accuracy& accuracy) noexcept {
  if (solution_.converged) return true;
  ++solution_.iterations;
  update_residual();
  measure(accuracy);
  if (solution_.converged || solution_.iterations >= accuracy.most_iterations) return true;
  const double kept = change_ == Change::kGained ? 0.0 : squares_ / squares_before_;
  const double step = step_along(kept);
  squares_before_ = squares_;
  change_ = move(step);
  const double factor = force_mN_ > 0.0 ? carry_force() : 1.0;
  if (factor == 0.0) return true;
  if (change_ != Change::kNone || solution_.iterations % kRefreshed == 0) {
    displace(pressure_, displaced_);
  } else {
    for (std::size_t i = 0; i < gap_.size(); ++i) {
      displaced_[i] = factor * (displaced_[i] - step * response_[i]);
    }
  }
  return false;
}

double RigidContact::area_mm2() const noexcept {
  double pixels = 0.0;
  // Along rows, then along columns.
  for (const bool rows : {true, false}) {
    const std::size_t lines = rows ? grid_.rows : grid_.columns;
    const std::size_t length = rows ? grid_.columns : grid_.rows;
    for (std::size_t line = 0; line < lines; ++line) {
      const auto at = [&](std::size_t i) {
        return rows ? line * grid_.columns + i : i * grid_.columns + line;
      };
      const auto carried = [&](std::size_t i) { return i < length ? pressure_[at(i)] : 0.0; };
      for (std::size_t i = 0; i < length; ++i) {
        if (!(carried(i) > 0.0)) continue;
        pixels += covered_[at(i)];
        if (compliance_[at(i)] != 0.0) continue;  // the rim is at the border
        // Before the first pixel, the index wraps to beyond the last one.
        if (!(carried(i - 1) > 0.0)) pixels += end_of_contact(carried(i), carried(i + 1)) - 0.5;
        if (!(carried(i + 1) > 0.0)) pixels += end_of_contact(carried(i), carried(i - 1)) - 0.5;
      }
    }
  }
  return 0.5 * pixels * grid_.pixel_mm * grid_.pixel_mm;
}

RigidContact::Solution RigidContact::solution() const noexcept {
  Solution found = solution_;
  found.force_mN = force_of_pressure_mN();
  for (const double p : pressure_) {
    found.peak_pressure_kPa = std::max(found.peak_pressure_kPa, p);
  }
  found.area_mm2 = area_mm2();
  return found;
}

}  // namespace merkel
