#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/receptors/kernel/receptor_kernel.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/receptors/kernel/receptor_kernel-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

void sphere_energy_double(const SphereField<double>& f, const ReceptorArguments<double>& a) {
  sphere_energy_all(f, a);
}
void sphere_energy_float(const SphereField<float>& f, const ReceptorArguments<float>& a) {
  sphere_energy_all(f, a);
}
void add_stress_double(const SphereField<double>& f, const ReceptorArguments<double>& a,
                       const StressArrays<double>& sums) {
  add_stress_all(f, a, sums);
}
void add_stress_float(const SphereField<float>& f, const ReceptorArguments<float>& a,
                      const StressArrays<float>& sums) {
  add_stress_all(f, a, sums);
}
void stress_energy_double(const StressArrays<double>& sums, const ReceptorArguments<double>& a,
                          double distortional, double volumetric) {
  stress_energy_all(sums, a, distortional, volumetric);
}
void stress_energy_float(const StressArrays<float>& sums, const ReceptorArguments<float>& a,
                         double distortional, double volumetric) {
  stress_energy_all(sums, a, distortional, volumetric);
}
void sigmoid_double(const SigmoidConstants<double>& c, const ReceptorArguments<double>& a,
                    double* current) {
  sigmoid_all(c, a, current);
}
void sigmoid_float(const SigmoidConstants<float>& c, const ReceptorArguments<float>& a,
                   float* current) {
  sigmoid_all(c, a, current);
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <cmath>

namespace merkel {

HWY_EXPORT(sphere_energy_double);
HWY_EXPORT(sphere_energy_float);
HWY_EXPORT(add_stress_double);
HWY_EXPORT(add_stress_float);
HWY_EXPORT(stress_energy_double);
HWY_EXPORT(stress_energy_float);
HWY_EXPORT(sigmoid_double);
HWY_EXPORT(sigmoid_float);

void sphere_energy(const SphereField<double>& f, const ReceptorArguments<double>& a) noexcept {
  HWY_DYNAMIC_DISPATCH(sphere_energy_double)(f, a);
}
void sphere_energy(const SphereField<float>& f, const ReceptorArguments<float>& a) noexcept {
  HWY_DYNAMIC_DISPATCH(sphere_energy_float)(f, a);
}
void add_sphere_stress(const SphereField<double>& f, const ReceptorArguments<double>& a,
                       const StressArrays<double>& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(add_stress_double)(f, a, sums);
}
void add_sphere_stress(const SphereField<float>& f, const ReceptorArguments<float>& a,
                       const StressArrays<float>& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(add_stress_float)(f, a, sums);
}
void stress_energy(const StressArrays<double>& sums, const ReceptorArguments<double>& a,
                   double distortional, double volumetric) noexcept {
  HWY_DYNAMIC_DISPATCH(stress_energy_double)(sums, a, distortional, volumetric);
}
void stress_energy(const StressArrays<float>& sums, const ReceptorArguments<float>& a,
                   double distortional, double volumetric) noexcept {
  HWY_DYNAMIC_DISPATCH(stress_energy_float)(sums, a, distortional, volumetric);
}
void sigmoid_currents(const SigmoidConstants<double>& c, const ReceptorArguments<double>& a,
                      double* current) noexcept {
  HWY_DYNAMIC_DISPATCH(sigmoid_double)(c, a, current);
}
void sigmoid_currents(const SigmoidConstants<float>& c, const ReceptorArguments<float>& a,
                      float* current) noexcept {
  HWY_DYNAMIC_DISPATCH(sigmoid_float)(c, a, current);
}

template <class Real>
SphereField<Real>::SphereField(const ContactState& contact, double pressure2, double x_mm,
                               double y_mm, const SkinMaterial& skin, EnergyDensity kind,
                               double receptor_depth_mm) {
  const auto real = [](double value) { return static_cast<Real>(value); };
  const double a = contact.contact_radius_mm;
  const double nu = skin.poisson_ratio();
  x = real(x_mm);
  y = real(y_mm);
  z = real(receptor_depth_mm);
  a2 = real(a * a);
  inverse_a = real(1.0 / a);
  a_over_z2 = real(a * a / (receptor_depth_mm * receptor_depth_mm));
  z2_minus_a2 = real((receptor_depth_mm - a) * (receptor_depth_mm + a));
  a2_z2 = real(a * a * receptor_depth_mm * receptor_depth_mm);
  one_minus_nu = real(1.0 - nu);
  one_plus_nu = real(1.0 + nu);
  third = real((1.0 - 2.0 * nu) / 3.0);
  p0 = real(std::sqrt(pressure2));
  distortional = real(pressure2 / (12.0 * skin.shear_modulus_kPa()));
  volumetric =
      real(kind == EnergyDensity::kFull ? pressure2 / (18.0 * skin.bulk_modulus_kPa()) : 0.0);
}

template struct SphereField<double>;
template struct SphereField<float>;

}  // namespace merkel
#endif
