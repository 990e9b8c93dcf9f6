#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/contact/kernel/grid_interpolation.cpp"
#include "core/contact/kernel/grid_interpolation.hpp"

#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target
#include <hwy/highway.h>

#include "core/simd/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// Lanes are the values of a node.
void interpolate_patch(const GridPatch& patch, GridNode& total) {
  using D = hn::CappedTag<float, 8>;
  constexpr int kVectors = static_cast<int>(8 / hn::MaxLanes(D()));
  using Math = SideBySide<D, kVectors>;
  using X = VectorPack<D, kVectors>;
  X sum[2];
  for (int t = 0; t < 2; ++t) {
    for (int j = 0; j < kVectors; ++j) sum[t].v[j] = hn::Zero(D());
    if (patch.corner[t] == nullptr) continue;
    for (std::size_t b = 0; b < 4; ++b) {
      const GridNode* const row = patch.corner[t] + b * patch.columns;
      for (std::size_t a = 0; a < 4; ++a) {
        const auto weight = Math::constant(patch.along_x[a] * patch.along_y[b]);
        sum[t] = Math::add(sum[t], Math::mul(Math::load(row[a].values.data()), weight));
      }
    }
    sum[t] = Math::mul(sum[t], Math::constant(patch.weight[t]));
  }
  Math::store(Math::add(sum[0], sum[1]), total.values.data());
}

/// Lanes are the values of a node.
void interpolate_energies(std::span<const EnergyPatch> patches, std::size_t columns,
                          EnergyNode* totals) {
  using D = hn::CappedTag<float, 4>;
  constexpr int kVectors = static_cast<int>(4 / hn::MaxLanes(D()));
  using Math = SideBySide<D, kVectors>;
  for (const EnergyPatch& patch : patches) {  // most nodes are in no cache
    for (std::size_t b = 0; b < 4 && patch.corner != nullptr; ++b) {
      hwy::Prefetch(patch.corner + b * columns);
      hwy::Prefetch(patch.corner + b * columns + 3);
    }
  }
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const EnergyPatch& patch = patches[i];
    if (patch.corner == nullptr) continue;
    VectorPack<D, kVectors> sum;
    for (int j = 0; j < kVectors; ++j) sum.v[j] = hn::Zero(D());
    for (std::size_t b = 0; b < 4; ++b) {
      const EnergyNode* const row = patch.corner + b * columns;
      for (std::size_t a = 0; a < 4; ++a) {
        const auto weight = Math::constant(patch.along_x[a] * patch.along_y[b]);
        sum = Math::add(sum, Math::mul(Math::load(row[a].values.data()), weight));
      }
    }
    Math::store(sum, totals[i].values.data());
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(interpolate_patch);
HWY_EXPORT(interpolate_energies);

GridNode interpolate(const GridPatch& patch) noexcept {
  GridNode total;
  HWY_DYNAMIC_DISPATCH(interpolate_patch)(patch, total);
  return total;
}

void interpolate(std::span<const EnergyPatch> patches, std::size_t columns,
                 EnergyNode* totals) noexcept {
  HWY_DYNAMIC_DISPATCH(interpolate_energies)(patches, columns, totals);
}

}  // namespace merkel
#endif
