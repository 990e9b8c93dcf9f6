#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/neurons/hodgkin_huxley/kernel/membrane_step_float.cpp"
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target

#include "core/neurons/hodgkin_huxley/kernel/membrane_step-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

void step_membranes_float(const KernelArguments<float>& arguments) { step_all(arguments); }

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(step_membranes_float);

void step_membranes(const KernelArguments<float>& arguments) noexcept {
  HWY_DYNAMIC_DISPATCH(step_membranes_float)(arguments);
}

}  // namespace merkel
#endif
