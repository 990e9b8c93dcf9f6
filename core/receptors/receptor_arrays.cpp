#include "core/receptors/receptor_arrays.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace merkel {
namespace {

/// The closed forms divide by the depth; this close to the surface, the stress no longer changes.
constexpr double kMinDepth_mm = 1e-6;

std::size_t padded(std::size_t receptors) {
  return (receptors + kReceptorBlock - 1) / kReceptorBlock * kReceptorBlock;
}

template <class Real>
double sum_of(const AlignedArray<Real>& values, std::size_t first, std::size_t last) noexcept {
  // Four sums side by side, because a single sum would wait for each addition.
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
      receptor_depth_mm_(std::max(skin.receptor_depth_mm, kMinDepth_mm)),
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
  known_blocks_.assign(x_.size() / kReceptorBlock, 0);
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
  const double pressure_kPa = placed.contact.peak_pressure_kPa;
  return SphereField<Real>(placed.contact, placed.stored_energy(pressure_kPa * pressure_kPa),
                           placed.x_mm, placed.y_mm, skin_, kind_, receptor_depth_mm_);
}

template <class Real>
void ReceptorArrays<Real>::add_tabulated(const PlacedContact& placed, std::size_t first,
                                         std::size_t last) noexcept {
  const double factor = std::sqrt(placed.stored_energy(1.0));
  for (std::size_t i = first; i < last; ++i) {
    const double dx = static_cast<double>(x_[i]) - placed.x_mm;
    const double dy = static_cast<double>(y_[i]) - placed.y_mm;
    const CartesianStress stress =
        (placed.sliding != nullptr ? placed.sliding->at(dx, dy).stress
                                   : placed.field->at(dx, dy, placed.contact.depth_mm).stress) *
        factor;
    const double parts[kSums] = {stress.sigma_x, stress.sigma_y, stress.sigma_z,
                                 stress.tau_xy,  stress.tau_yz,  stress.tau_zx};
    for (std::size_t k = 0; k < kSums; ++k) sums_[k][i] += static_cast<Real>(parts[k]);
  }
}

template <class Real>
void ReceptorArrays<Real>::press(std::span<const PlacedContact> contacts, std::size_t first,
                                 std::size_t last) noexcept {
  const ReceptorArguments<Real> receptors = blocks(first, last);
  if (contacts.size() == 1) {
    const PlacedContact& only = contacts.front();
    if (only.taxels != nullptr) return copy_energies(*only.taxels, first, last);
    if (only.field != nullptr) return press_alone(only, receptors.first, receptors.last);
    if (only.sliding != nullptr) return slide_alone(only, receptors.first, receptors.last);
    return sphere_energy(field(only), receptors);
  }
  remembered_.field = nullptr;
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
    if (placed.field != nullptr || placed.sliding != nullptr) {
      add_tabulated(placed, receptors.first, receptors.last);
    } else {
      add_sphere_stress(field(placed), receptors, sums);
    }
  }
  stress_energy(sums, receptors, 1.0 / (12.0 * skin_.shear_modulus_kPa()),
                kind_ == EnergyDensity::kFull ? 1.0 / (18.0 * skin_.bulk_modulus_kPa()) : 0.0);
}

template <class Real>
void ReceptorArrays<Real>::copy_energies(const TaxelField& taxels, std::size_t first,
                                         std::size_t last) noexcept {
  const std::span<const float> energies = taxels.energies_kPa();
  for (std::size_t i = first; i < last; ++i) energy_[i] = static_cast<Real>(energies[i]);
}

template <class Real>
void ReceptorArrays<Real>::press_alone(const PlacedContact& placed, std::size_t first,
                                       std::size_t last) noexcept {
  const TipField::Blend blend = placed.field->blend(placed.contact.depth_mm);
  const RememberedContact now{placed.field, placed.x_mm, placed.y_mm, blend.lower};
  if (!(now == remembered_)) {
    remembered_ = now;
    std::fill(known_blocks_.begin(), known_blocks_.end(), std::uint8_t{0});
  }
  for (std::size_t block = first / kReceptorBlock; block < last / kReceptorBlock; ++block) {
    if (known_blocks_[block] != 0) continue;
    known_blocks_[block] = 1;
    const std::size_t begin = block * kReceptorBlock;
    std::array<double, kReceptorBlock> dx, dy;
    for (std::size_t i = 0; i < kReceptorBlock; ++i) {
      dx[i] = static_cast<double>(x_[begin + i]) - placed.x_mm;
      dy[i] = static_cast<double>(y_[begin + i]) - placed.y_mm;
    }
    static_assert(kReceptorBlock <= GridPoints::kCount);
    std::array<TipField::Energies, kReceptorBlock> energies;
    placed.field->energies(blend.lower, dx, dy, energies);
    for (std::size_t i = 0; i < kReceptorBlock; ++i) {
      sums_[0][begin + i] = static_cast<Real>(energies[i].lower);
      sums_[1][begin + i] = static_cast<Real>(energies[i].cross);
      sums_[2][begin + i] = static_cast<Real>(energies[i].upper);
    }
  }
  const auto [below, above] = blend.weight;
  const auto lower = static_cast<Real>(placed.stored_energy(below * below));
  const auto cross = static_cast<Real>(placed.stored_energy(below * above));
  const auto upper = static_cast<Real>(placed.stored_energy(above * above));
  for (std::size_t i = first; i < last; ++i) {
    const Real energy = lower * sums_[0][i] + cross * sums_[1][i] + upper * sums_[2][i];
    energy_[i] = std::max(energy, Real(0));
  }
}

template <class Real>
void ReceptorArrays<Real>::slide_alone(const PlacedContact& placed, std::size_t first,
                                       std::size_t last) noexcept {
  for (std::size_t i = first; i < last; ++i) {
    energy_[i] = static_cast<Real>(placed.stored_energy(placed.sliding->energy_kPa(
        static_cast<double>(x_[i]) - placed.x_mm, static_cast<double>(y_[i]) - placed.y_mm)));
  }
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
