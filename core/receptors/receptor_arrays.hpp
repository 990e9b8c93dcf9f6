#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/contact/placed_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/kernel/receptor_kernel.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/receptors/sigmoid_transduction.hpp"
#include "core/simd/aligned_array.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// Receptors are processed in whole blocks of this size, so that the set of processed receptors
/// does not depend on the vector width.
inline constexpr std::size_t kReceptorBlock = 16;

/// The receptors of a patch as a structure of arrays in one precision, and the kernel calls that
/// process them. Real-time: yes, after construction.
template <class Real>
class ReceptorArrays {
 public:
  ReceptorArrays(std::span<const Receptor> receptors, const SkinParameters& skin,
                 const SigmoidTransduction& transduction);

  /// Computes the energy densities under the sum of all contacts, for the receptors [first, last)
  /// and the rest of their blocks.
  void press(std::span<const PlacedContact> contacts, std::size_t first,
             std::size_t last) noexcept MERKEL_REALTIME;
  /// Computes their currents, without the threshold, from their energy densities.
  void transduce(std::size_t first, std::size_t last) noexcept MERKEL_REALTIME;
  /// Sets the energy densities of the receptors [first, last), and of the rest of their blocks, to
  /// 0.
  void clear_energy(std::size_t first, std::size_t last) noexcept MERKEL_REALTIME;

  /// Sum over the receptors [first, last), µA/cm², in an order that does not depend on the
  /// instruction set.
  [[nodiscard]] double sum_of_currents(std::size_t first,
                                       std::size_t last) const noexcept MERKEL_REALTIME;
  /// Sum over the receptors [first, last), kPa, in the same order.
  [[nodiscard]] double sum_of_energy_densities(std::size_t first,
                                               std::size_t last) const noexcept MERKEL_REALTIME;
  void silence(std::size_t receptor) noexcept { current_[receptor] = Real(0); }
  [[nodiscard]] double energy_density_kPa(std::size_t receptor) const noexcept {
    return static_cast<double>(energy_[receptor]);
  }

 private:
  static constexpr std::size_t kSums = 6;

  [[nodiscard]] ReceptorArguments<Real> blocks(std::size_t first, std::size_t last) noexcept;
  [[nodiscard]] SphereField<Real> field(const PlacedContact& placed) const noexcept;
  /// Adds the stress of a solved contact.
  void add_tabulated(const PlacedContact& placed, std::size_t first, std::size_t last) noexcept;
  /// The energy densities under one solved contact. While the tip stays in place and between the
  /// same two depths of its tables, they are remembered at every receptor.
  void press_alone(const PlacedContact& placed, std::size_t first, std::size_t last) noexcept;
  /// The energy densities under a tactile array.
  void copy_energies(const TaxelField& taxels, std::size_t first, std::size_t last) noexcept;
  /// The energy densities under one sliding surface.
  void slide_alone(const PlacedContact& placed, std::size_t first, std::size_t last) noexcept;

  SkinMaterial skin_;
  EnergyDensity kind_;
  double receptor_depth_mm_;
  SigmoidConstants<Real> sigmoid_;
  AlignedArray<Real> x_, y_, energy_, current_;
  /// Of stresses; of one solved contact, the first three are TipField::Energies.
  AlignedArray<Real> sums_[kSums];
  /// The solved contact whose energies are remembered, in the blocks that are known.
  struct RememberedContact {
    const TipField* field = nullptr;
    double x_mm = 0.0, y_mm = 0.0;
    std::size_t lower = 0;
    friend bool operator==(const RememberedContact&, const RememberedContact&) = default;
  };
  RememberedContact remembered_;
  std::vector<std::uint8_t> known_blocks_;
};

extern template class ReceptorArrays<double>;
extern template class ReceptorArrays<float>;

}  // namespace merkel
