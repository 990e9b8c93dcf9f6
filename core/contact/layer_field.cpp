#include "core/contact/layer_field.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/math/cubic_interpolation.hpp"

namespace merkel {

std::size_t LayerField::points_within(double distance_mm) const noexcept {
  const double wanted =
      std::min(distance_mm / table_.spacing_mm, static_cast<double>(table_.points)) + 4.0;
  return std::min(table_.points, static_cast<std::size_t>(wanted));
}

LayerField::Rows LayerField::rows_of(const ContactState& contact) const noexcept {
  const double last = static_cast<double>(table_.rows - 1);
  const double place = std::min(contact.contact_radius_mm / table_.row_spacing_mm, last);
  // The field is even in the contact radius: row −1 is row 1. At the end, the last rows are used.
  const double below = std::min(std::floor(place), last - 2.0);
  const auto weights = cubic_weights(place - below);
  const auto first = static_cast<std::size_t>(below);
  Rows rows{};
  for (std::size_t i = 0; i < kRowWeights; ++i) {
    rows.row[i] = first + i == 0 ? 1 : first + i - 1;
    rows.weight[i] = weights[i] * contact.force_mN;
  }
  return rows;
}

void LayerField::profile(const ContactState& contact, Field field,
                         std::span<double> values_at) const noexcept {
  assert(values_at.size() <= table_.points);
  const Rows rows = rows_of(contact);
  const double* const a = table_.of(field, rows.row[0]);
  const double* const b = table_.of(field, rows.row[1]);
  const double* const c = table_.of(field, rows.row[2]);
  const double* const d = table_.of(field, rows.row[3]);
  for (std::size_t k = 0; k < values_at.size(); ++k) {
    values_at[k] = (rows.weight[0] * a[k] + rows.weight[1] * b[k]) +
                   (rows.weight[2] * c[k] + rows.weight[3] * d[k]);
  }
}

double LayerField::at(const Rows& rows, Field field, double r_mm) const noexcept {
  const double place = r_mm / table_.spacing_mm;
  if (!(place < static_cast<double>(table_.points - 3))) return 0.0;
  const auto first = static_cast<std::size_t>(place);
  const auto weights = cubic_weights(place - static_cast<double>(first));
  double sum = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    // All but the shear are even in r.
    const bool mirrored = first + i == 0;
    const std::size_t point = mirrored ? 1 : first + i - 1;
    double value = 0.0;
    for (std::size_t k = 0; k < kRowWeights; ++k) {
      value += rows.weight[k] * table_.of(field, rows.row[k])[point];
    }
    sum += weights[i] * (mirrored && field == LayerTable::kTauRz ? -value : value);
  }
  return sum;
}

AxisymmetricStress LayerField::stress(const ContactState& contact, double r_mm) const noexcept {
  const Rows rows = rows_of(contact);
  return {.sigma_r = at(rows, LayerTable::kSigmaR, r_mm),
          .sigma_theta = at(rows, LayerTable::kSigmaTheta, r_mm),
          .sigma_z = at(rows, LayerTable::kSigmaZ, r_mm),
          .tau_rz = at(rows, LayerTable::kTauRz, r_mm)};
}

double LayerField::displacement_mm(const ContactState& contact, double r_mm) const noexcept {
  return at(rows_of(contact), LayerTable::kDisplacement, r_mm);
}

double LayerField::radius_of_displacement_mm(const ContactState& contact,
                                             double displacement_mm) const noexcept {
  const Rows rows = rows_of(contact);
  const auto displaced = [&](std::size_t k) {
    return at(rows, LayerTable::kDisplacement, table_.spacing_mm * static_cast<double>(k)) >=
           displacement_mm;
  };
  // The displacement falls smoothly: search in long strides, then point by point.
  constexpr std::size_t kStride = 8;
  std::size_t point = 0;
  while (point + kStride + 4 < table_.points && displaced(point + kStride)) point += kStride;
  while (point + 4 < table_.points && displaced(point)) ++point;
  if (point == 0) return 0.0;
  double low = table_.spacing_mm * static_cast<double>(point - 1);
  double high = table_.spacing_mm * static_cast<double>(point);
  while (high - low > 1e-6) {
    const double middle = 0.5 * (low + high);
    (at(rows, LayerTable::kDisplacement, middle) >= displacement_mm ? low : high) = middle;
  }
  return low;
}

}  // namespace merkel
