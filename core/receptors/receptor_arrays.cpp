#include "core/receptors/receptor_arrays.hpp"

#include <algorithm>

namespace merkel {
namespace {

/// The closed forms divide by the depth; so close to the surface, nothing changes any more.
constexpr double kLeastDepth_mm = 1e-6;

std::size_t padded(std::size_t receptors) {
  return (receptors + kReceptorBlock - 1) / kReceptorBlock * kReceptorBlock;
}

template <class Real>
double sum_of(const AlignedArray<Real>& values, std::size_t first, std::size_t last) noexcept {
  // Four sums side by side: one alone would wait for each addition.
  double sums[4] = {0.0, 0.0, 0.0, 0.0};
  std::size_t i = first;
  for (; i + 4 <= last; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) sums[k] += static_cast<double>(values[i + k]);
  }
  for (; i < last; ++i) sums[0] += static_cast<double>(values[i]);
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace

template <class Real>
ReceptorArrays<Real>::ReceptorArrays(std::span<const Receptor> receptors,
                                     const SkinParameters& skin,
                                     const SigmoidTransduction& transduction)
    : skin_(skin),
      kind_(skin.energy_density),
      receptor_depth_mm_(std::max(skin.receptor_depth_mm, kLeastDepth_mm)),
      sigmoid_{
          .alpha = static_cast<Real>(transduction.alpha_uA_per_cm2),
          .gamma = static_cast<Real>(transduction.gamma_per_kPa),
          .gamma_lambda = static_cast<Real>(transduction.gamma_per_kPa * transduction.lambda_kPa)},
      x_(padded(receptors.size())),
      y_(padded(receptors.size())),
      energy_(padded(receptors.size())),
      current_(padded(receptors.size())) {
  for (std::size_t i = 0; i < receptors.size(); ++i) {
    x_[i] = static_cast<Real>(receptors[i].x_mm);
    y_[i] = static_cast<Real>(receptors[i].y_mm);
  }
  for (AlignedArray<Real>& sum : sums_) sum = AlignedArray<Real>(padded(receptors.size()));
}

template <class Real>
ReceptorArguments<Real> ReceptorArrays<Real>::blocks(std::size_t first, std::size_t last) noexcept {
  return {.x = x_.data(),
          .y = y_.data(),
          .first = first / kReceptorBlock * kReceptorBlock,
          .last = padded(last),
          .energy = energy_.data()};
}

template <class Real>
SphereField<Real> ReceptorArrays<Real>::field(const PlacedContact& placed) const noexcept {
  return SphereField<Real>(placed.contact, placed.x_mm, placed.y_mm, skin_, kind_,
                           receptor_depth_mm_);
}

template <class Real>
void ReceptorArrays<Real>::add_bars(const PlacedContact& placed, std::size_t first,
                                    std::size_t last) noexcept {
  const double depth_mm = placed.contact.depth_mm;
  for (std::size_t i = first; i < last; ++i) {
    const FlatTipField::Unit unit = placed.flat_tip->at(static_cast<double>(x_[i]) - placed.x_mm,
                                                        static_cast<double>(y_[i]) - placed.y_mm);
    const double parts[kSums] = {unit.stress.sigma_x, unit.stress.sigma_y, unit.stress.sigma_z,
                                 unit.stress.tau_xy,  unit.stress.tau_yz,  unit.stress.tau_zx};
    for (std::size_t k = 0; k < kSums; ++k) {
      sums_[k][i] += static_cast<Real>(parts[k] * depth_mm);
    }
  }
}

template <class Real>
void ReceptorArrays<Real>::press(std::span<const PlacedContact> contacts, std::size_t first,
                                 std::size_t last) noexcept {
  const ReceptorArguments<Real> receptors = blocks(first, last);
  if (contacts.size() == 1 && contacts.front().flat_tip == nullptr) {
    sphere_energy(field(contacts.front()), receptors);
    return;
  }
  for (AlignedArray<Real>& sum : sums_) {
    std::fill(sum.data() + receptors.first, sum.data() + receptors.last, Real(0));
  }
  const StressArrays<Real> sums{.sigma_x = sums_[0].data(),
                                .sigma_y = sums_[1].data(),
                                .sigma_z = sums_[2].data(),
                                .tau_xy = sums_[3].data(),
                                .tau_yz = sums_[4].data(),
                                .tau_zx = sums_[5].data()};
  for (const PlacedContact& placed : contacts) {
    if (placed.flat_tip != nullptr) {
      add_bars(placed, receptors.first, receptors.last);
    } else {
      add_sphere_stress(field(placed), receptors, sums);
    }
  }
  stress_energy(sums, receptors, 1.0 / (12.0 * skin_.shear_modulus_kPa()),
                kind_ == EnergyDensity::kFull ? 1.0 / (18.0 * skin_.bulk_modulus_kPa()) : 0.0);
}

template <class Real>
void ReceptorArrays<Real>::transduce(std::size_t first, std::size_t last) noexcept {
  sigmoid_currents(sigmoid_, blocks(first, last), current_.data());
}

template <class Real>
void ReceptorArrays<Real>::clear_energy(std::size_t first, std::size_t last) noexcept {
  const ReceptorArguments<Real> receptors = blocks(first, last);
  std::fill(energy_.data() + receptors.first, energy_.data() + receptors.last, Real(0));
}

template <class Real>
double ReceptorArrays<Real>::sum_of_currents(std::size_t first, std::size_t last) const noexcept {
  return sum_of(current_, first, last);
}

template <class Real>
double ReceptorArrays<Real>::sum_of_energy_densities(std::size_t first,
                                                     std::size_t last) const noexcept {
  return sum_of(energy_, first, last);
}

template class ReceptorArrays<double>;
template class ReceptorArrays<float>;

}  // namespace merkel
