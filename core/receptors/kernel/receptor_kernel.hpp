#pragma once

#include <cstddef>

#include "core/records/contact_state.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// A sphere's contact in the form that the receptor kernels use (Huber's closed form, see
/// huber_stress.hpp).
template <class Real>
struct SphereField {
  SphereField() = default;
  /// \param pressure2  square of the peak pressure that stores the same energy in skin at rest
  /// \param receptor_depth_mm  > 0
  SphereField(const ContactState& contact, double pressure2, double x_mm, double y_mm,
              const SkinMaterial& skin, EnergyDensity kind, double receptor_depth_mm);

  Real x = 0, y = 0;   ///< position of the axis
  Real z = 1;          ///< depth of the receptors
  Real a2 = 0;         ///< a²
  Real inverse_a = 0;  ///< 1/a
  Real a_over_z2 = 0;  ///< (a/z)²
  Real z2_minus_a2 = 0;
  Real a2_z2 = 0;  ///< a²z²
  Real one_minus_nu = 0, one_plus_nu = 0;
  Real third = 0;         ///< (1−2ν)/3
  Real p0 = 0;            ///< of unstiffened skin with the same energy
  Real distortional = 0;  ///< p0²/(12G): energy per (σ_i−σ_j)² in units of p0
  Real volumetric = 0;    ///< p0²/(18K), or 0
};

/// Receptors as a structure of arrays; all arrays are padded to whole vectors.
template <class Real>
struct ReceptorArguments {
  const Real* x = nullptr;
  const Real* y = nullptr;
  std::size_t first = 0;  ///< receptors [first, last)
  std::size_t last = 0;
  Real* energy = nullptr;  ///< strain energy density, kPa
};

/// Stresses of all contacts, summed at every receptor, kPa.
template <class Real>
struct StressArrays {
  Real* sigma_x = nullptr;
  Real* sigma_y = nullptr;
  Real* sigma_z = nullptr;
  Real* tau_xy = nullptr;
  Real* tau_yz = nullptr;
  Real* tau_zx = nullptr;
};

/// The sigmoid of Eq. 7 in the form that the kernel uses: α/(1+e^{γλ − γ·SED}).
template <class Real>
struct SigmoidConstants {
  Real alpha = 0;
  Real gamma = 0;
  Real gamma_lambda = 0;
};

/// Energy density under one sphere. All functions below are bit-identical on every instruction set.
/// Real-time: yes.
void sphere_energy(const SphereField<double>& field,
                   const ReceptorArguments<double>& receptors) noexcept;
void sphere_energy(const SphereField<float>& field,
                   const ReceptorArguments<float>& receptors) noexcept;

/// Adds the stress of one sphere to the sums.
void add_sphere_stress(const SphereField<double>& field, const ReceptorArguments<double>& receptors,
                       const StressArrays<double>& sums) noexcept;
void add_sphere_stress(const SphereField<float>& field, const ReceptorArguments<float>& receptors,
                       const StressArrays<float>& sums) noexcept;

/// Energy density of the summed stresses; distortional and volumetric factors are 1/(12G) and
/// 1/(18K).
void stress_energy(const StressArrays<double>& sums, const ReceptorArguments<double>& receptors,
                   double distortional, double volumetric) noexcept;
void stress_energy(const StressArrays<float>& sums, const ReceptorArguments<float>& receptors,
                   double distortional, double volumetric) noexcept;

/// Currents of receptors: the sigmoid of their energy densities.
void sigmoid_currents(const SigmoidConstants<double>& sigmoid,
                      const ReceptorArguments<double>& receptors, double* current) noexcept;
void sigmoid_currents(const SigmoidConstants<float>& sigmoid,
                      const ReceptorArguments<float>& receptors, float* current) noexcept;

}  // namespace merkel
