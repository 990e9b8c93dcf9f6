#include "core/simd/simd_target.hpp"

#include <cstdint>

#include <hwy/highway.h>
#include <hwy/targets.h>

namespace merkel {
namespace {

std::string name_of(std::int64_t target) {
  switch (target) {
#if HWY_ARCH_X86
    case HWY_AVX3:
      return "avx512";
    case HWY_AVX2:
      return "avx2";
#endif
#if HWY_ARCH_ARM
    case HWY_NEON:
      return "neon";
#endif
    case HWY_EMU128:
    case HWY_SCALAR:
      return "scalar";
    default:
      return hwy::TargetName(target);
  }
}

/// Those of this processor that the kernels were compiled for, best first. A build for one
/// instruction set that Highway does not look for (NEON without AES) has that one.
std::vector<std::int64_t> targets() {
  std::vector<std::int64_t> found = hwy::SupportedAndGeneratedTargets();
  if (found.empty()) found.push_back(HWY_STATIC_TARGET);
  return found;
}

}  // namespace

std::vector<std::string> simd_targets() {
  std::vector<std::string> names;
  for (const std::int64_t target : targets()) names.push_back(name_of(target));
  return names;
}

std::string simd_target() { return name_of(targets().front()); }

Expected<void, SetupError> force_simd_target(std::string_view name) {
  hwy::SetSupportedTargetsForTest(0);
  if (name.empty()) return {};
  std::string known;
  for (const std::int64_t target : targets()) {
    if (name_of(target) == name) {
      hwy::SetSupportedTargetsForTest(target);
      return {};
    }
    known.append(known.empty() ? "" : ", ").append(name_of(target));
  }
  return bad_input("this processor does not support the instruction set \"" + std::string(name) +
                   "\"; it supports " + known);
}

}  // namespace merkel
