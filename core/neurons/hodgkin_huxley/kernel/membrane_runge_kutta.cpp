#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/hodgkin_huxley/kernel/membrane_runge_kutta.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/hodgkin_huxley/kernel/membrane_runge_kutta-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

void runge_kutta_double(const KernelArguments<double>& arguments, const RungeKuttaScheme& scheme,
                        const RungeKuttaScratch<double>& scratch) {
  runge_kutta(arguments, scheme, scratch);
}

void runge_kutta_float(const KernelArguments<float>& arguments, const RungeKuttaScheme& scheme,
                       const RungeKuttaScratch<float>& scratch) {
  runge_kutta(arguments, scheme, scratch);
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(runge_kutta_double);
HWY_EXPORT(runge_kutta_float);

void step_membranes(const KernelArguments<double>& arguments, const RungeKuttaScheme& scheme,
                    const RungeKuttaScratch<double>& scratch) noexcept {
  HWY_DYNAMIC_DISPATCH(runge_kutta_double)(arguments, scheme, scratch);
}

void step_membranes(const KernelArguments<float>& arguments, const RungeKuttaScheme& scheme,
                    const RungeKuttaScratch<float>& scratch) noexcept {
  HWY_DYNAMIC_DISPATCH(runge_kutta_float)(arguments, scheme, scratch);
}

}  // namespace merkel
#endif
