#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/afferent/receptor_placement.hpp"
#include "core/afferent/sigmoid_transduction.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/bar_stress_field.hpp"
#include "core/skin/skin_material.hpp"
#include "core/skin/sphere_contact.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// A contact and where on the patch its axis is.
struct PlacedContact {
  SphereContact contact;                 ///< of bars, depth and force only
  const BarStressField* bars = nullptr;  ///< null for a sphere
  double x_mm = 0.0;
  double y_mm = 0.0;
};

/// From contacts to the current of every afferent: I_n = Σ over its receptors of the sigmoid of
/// the strain energy density at receptor depth (Eq. 14).
///
/// Several contacts act together: their stresses and displacements add (the half-space is linear),
/// and the energy density is that of the sum. Real-time: yes, after construction.
class ReceptorDrive {
 public:
  /// \param neurons  number of afferents; each receptor names one, from 1
  ReceptorDrive(std::span<const Receptor> receptors, std::size_t neurons,
                const SkinParameters& skin, const SigmoidTransduction& transduction);

  /// Writes the current of every afferent, µA/cm².
  void compute(std::span<const PlacedContact> contacts,
               std::span<double> current_uA_per_cm2) noexcept MERKEL_REALTIME;

  /// The receptors, grouped by afferent.
  [[nodiscard]] std::span<const Receptor> receptors() const noexcept { return receptors_; }
  /// Strain energy density at every receptor, in the order of receptors(), as computed last; kPa.
  [[nodiscard]] std::span<const double> energy_density_kPa() const noexcept {
    return energy_density_kPa_;
  }

 private:
  void superpose(std::span<const PlacedContact> contacts) noexcept;
  void press_with_one_sphere(const PlacedContact& placed) noexcept;

  std::vector<Receptor> receptors_;
  std::vector<std::size_t> first_of_neuron_;  ///< N+1 offsets into receptors_
  SkinMaterial skin_;
  EnergyDensity kind_;
  double receptor_depth_mm_;
  SigmoidTransduction transduction_;
  std::vector<double> energy_density_kPa_;
  std::vector<double> displacement_mm_;
};

}  // namespace merkel
