#include "core/afferent/receptor_drive.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/skin/hertz_contact.hpp"
#include "core/skin/huber_stress.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"

namespace merkel {

ReceptorDrive::ReceptorDrive(std::span<const Receptor> receptors, std::size_t neurons,
                             const SkinParameters& skin, const SigmoidTransduction& transduction)
    : receptors_(receptors.begin(), receptors.end()),
      first_of_neuron_(neurons + 1),
      skin_(skin),
      kind_(skin.energy_density),
      receptor_depth_mm_(skin.receptor_depth_mm),
      transduction_(transduction),
      energy_density_kPa_(receptors.size()),
      displacement_mm_(receptors.size()) {
  std::stable_sort(receptors_.begin(), receptors_.end(),
                   [](const Receptor& a, const Receptor& b) { return a.neuron < b.neuron; });
  for (const Receptor& receptor : receptors_) {
    assert(receptor.neuron >= 1 && receptor.neuron <= neurons);
    ++first_of_neuron_[receptor.neuron];
  }
  for (std::size_t n = 1; n <= neurons; ++n) first_of_neuron_[n] += first_of_neuron_[n - 1];
}

void ReceptorDrive::press_with_one_sphere(const PlacedContact& placed) noexcept {
  for (std::size_t i = 0; i < receptors_.size(); ++i) {
    const double r = std::hypot(receptors_[i].x_mm - placed.x_mm, receptors_[i].y_mm - placed.y_mm);
    energy_density_kPa_[i] = merkel::energy_density_kPa(
        huber_stress(placed.contact, skin_.poisson_ratio(), r, receptor_depth_mm_), skin_, kind_);
    displacement_mm_[i] = HertzContact::surface_displacement_mm(placed.contact, r);
  }
}

void ReceptorDrive::superpose(std::span<const PlacedContact> contacts) noexcept {
  for (std::size_t i = 0; i < receptors_.size(); ++i) {
    CartesianStress sum;
    double displacement_mm = 0.0;
    for (const PlacedContact& placed : contacts) {
      const double dx = receptors_[i].x_mm - placed.x_mm;
      const double dy = receptors_[i].y_mm - placed.y_mm;
      if (placed.bars != nullptr) {
        const BarStressField::Unit unit = placed.bars->at(dx, dy);
        sum += unit.stress * placed.contact.depth_mm;
        displacement_mm += unit.displacement * placed.contact.depth_mm;
      } else {
        const double r = std::hypot(dx, dy);
        sum += cartesian(huber_stress(placed.contact, skin_.poisson_ratio(), r, receptor_depth_mm_),
                         dx, dy);
        displacement_mm += HertzContact::surface_displacement_mm(placed.contact, r);
      }
    }
    energy_density_kPa_[i] = merkel::energy_density_kPa(sum, skin_, kind_);
    displacement_mm_[i] = displacement_mm;
  }
}

void ReceptorDrive::compute(std::span<const PlacedContact> contacts,
                            std::span<double> current_uA_per_cm2) noexcept {
  assert(current_uA_per_cm2.size() + 1 == first_of_neuron_.size());
  if (contacts.empty()) {
    std::fill(energy_density_kPa_.begin(), energy_density_kPa_.end(), 0.0);
    std::fill(current_uA_per_cm2.begin(), current_uA_per_cm2.end(), 0.0);
    return;
  }
  if (contacts.size() == 1 && contacts.front().bars == nullptr) {
    press_with_one_sphere(contacts.front());
  } else {
    superpose(contacts);
  }
  const double threshold_mm = units::mm_from_um(transduction_.threshold_um);
  for (std::size_t n = 0; n < current_uA_per_cm2.size(); ++n) {
    double sum = 0.0;
    for (std::size_t i = first_of_neuron_[n]; i < first_of_neuron_[n + 1]; ++i) {
      if (displacement_mm_[i] >= threshold_mm) {
        sum += transduction_.current_uA_per_cm2(energy_density_kPa_[i]);
      }
    }
    current_uA_per_cm2[n] = sum;
  }
}

}  // namespace merkel
