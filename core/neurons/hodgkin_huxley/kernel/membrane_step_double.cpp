#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/hodgkin_huxley/kernel/membrane_step_double.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/hodgkin_huxley/kernel/membrane_step-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

void step_membranes_double(const KernelArguments<double>& arguments) { step_all(arguments); }

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(step_membranes_double);

void step_membranes(const KernelArguments<double>& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(step_membranes_double)(arguments);
}

}  // namespace merkel
#endif
