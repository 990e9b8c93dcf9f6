#include "core/contact/solver/pixel_kernels.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace merkel {
namespace {

using std::numbers::pi;

/// x·asinh(y/|x|), 0 at x = 0.
double love_part(double x, double y) { return x == 0.0 ? 0.0 : x * std::asinh(y / std::fabs(x)); }

double love(double x, double y) { return love_part(x, y) + love_part(y, x); }

/// Radius of the disc with a pixel's area.
double disc_of(double pixel_mm) { return pixel_mm / std::sqrt(pi); }

/// The largest offset of a window's pixel from a contact's, plus one.
std::size_t most_offsets(std::size_t contact, std::size_t window) { return (contact + window) / 2; }

/// The offset, in pixels, that a periodic index stands for; the window's first pixel has index 0.
std::ptrdiff_t offset_of(std::size_t index, std::size_t size, std::size_t contact,
                         std::size_t window) {
  const auto shift =
      (static_cast<std::ptrdiff_t>(window) - static_cast<std::ptrdiff_t>(contact)) / 2;
  const auto wrapped = index < window ? 0 : static_cast<std::ptrdiff_t>(size);
  return static_cast<std::ptrdiff_t>(index) - wrapped - shift;
}

/// A component of the stress, with the signs of the offset from the load.
double component(const CartesianStress& stress, PixelField field, double sign_x, double sign_y) {
  switch (field) {
    case PixelField::kSigmaX:
      return stress.sigma_x;
    case PixelField::kSigmaY:
      return stress.sigma_y;
    case PixelField::kSigmaZ:
      return stress.sigma_z;
    case PixelField::kTauXy:
      return sign_x * sign_y * stress.tau_xy;
    case PixelField::kTauYz:
      return sign_y * stress.tau_yz;
    case PixelField::kTauZx:
      return sign_x * stress.tau_zx;
    case PixelField::kDisplacement:
      break;
  }
  return 0.0;
}

}  // namespace

std::size_t padded_pixels(std::size_t pixels) noexcept {
  return std::max<std::size_t>(32, std::bit_ceil(pixels));
}

double pixel_displacement_mm(double x_mm, double y_mm, double pixel_mm) noexcept {
  const double a = 0.5 * pixel_mm;
  return (love(x_mm + a, y_mm + a) - love(x_mm - a, y_mm + a) - love(x_mm + a, y_mm - a) +
          love(x_mm - a, y_mm - a)) /
         pi;
}

PixelKernels::PixelKernels(const LayeredMedium& medium, double z_mm, const PixelGrid& contact,
                           const PixelGrid& window)
    : medium_(medium),
      z_mm_(z_mm),
      contact_(contact),
      window_(window),
      transform_(padded_pixels(contact.columns + window.columns - 1),
                 padded_pixels(contact.rows + window.rows - 1)),
      most_columns_(most_offsets(contact.columns, window.columns)),
      most_rows_(most_offsets(contact.rows, window.rows)) {
  assert((window.columns - contact.columns) % 2 == 0 && (window.rows - contact.rows) % 2 == 0);
}

void PixelKernels::compute_responses() {
  const double pixel = contact_.pixel_mm;
  const double force_mN = pixel * pixel;
  const PointResponse response(
      medium_, z_mm_, disc_of(pixel),
      pixel * std::hypot(static_cast<double>(most_columns_), static_cast<double>(most_rows_)));
  responses_.reserve(most_columns_ * most_rows_);
  for (std::size_t row = 0; row < most_rows_; ++row) {
    for (std::size_t column = 0; column < most_columns_; ++column) {
      const double x = pixel * static_cast<double>(column);
      const double y = pixel * static_cast<double>(row);
      const double r = std::hypot(x, y);
      responses_.push_back(
          {.stress = cartesian(response.stress(r), x, y) * force_mN,
           .excess_displacement_mm =
               medium_.half_space() ? 0.0 : force_mN * response.excess_displacement_mm(r)});
    }
  }
}

GridSpectrum PixelKernels::kernel(PixelField field) {
  const bool displacement = field == PixelField::kDisplacement;
  const bool tabled = !displacement || !medium_.half_space();
  if (tabled && responses_.empty()) compute_responses();
  const double pixel = contact_.pixel_mm;
  std::vector<double> love_values;
  if (displacement) {
    for (std::size_t row = 0; row < most_rows_; ++row) {
      for (std::size_t column = 0; column < most_columns_; ++column) {
        love_values.push_back(pixel_displacement_mm(pixel * static_cast<double>(column),
                                                    pixel * static_cast<double>(row), pixel) /
                              medium_.reduced_modulus_kPa());
      }
    }
  }
  const std::size_t columns = transform_.columns();
  const std::size_t rows = transform_.rows();
  std::vector<double> image(columns * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::ptrdiff_t dy = offset_of(row, rows, contact_.rows, window_.rows);
    const auto j = static_cast<std::size_t>(std::abs(dy));
    if (j >= most_rows_) continue;
    for (std::size_t column = 0; column < columns; ++column) {
      const std::ptrdiff_t dx = offset_of(column, columns, contact_.columns, window_.columns);
      const auto i = static_cast<std::size_t>(std::abs(dx));
      if (i >= most_columns_) continue;
      const std::size_t at = j * most_columns_ + i;
      double& value = image[row * columns + column];
      if (displacement) value = love_values[at];
      if (!tabled) continue;
      value += displacement ? responses_[at].excess_displacement_mm
                            : component(responses_[at].stress, field, dx < 0 ? -1.0 : 1.0,
                                        dy < 0 ? -1.0 : 1.0);
    }
  }
  GridSpectrum spectrum = transform_.make_spectrum();
  transform_.forward(image, columns, rows, spectrum);
  return spectrum;
}

}  // namespace merkel
