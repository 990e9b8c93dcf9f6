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

/// Of the 16 nodes around each point.
struct PointWeights {
  alignas(64) float weight[16][GridPoints::kCount];
  std::size_t first[GridPoints::kCount];
};

/// As cubic_weights().
template <class D>
void cubic_weights_of(D d, hn::Vec<D> t, hn::Vec<D> (&weights)[4]) {
  const auto one = hn::Set(d, 1.0);
  const auto two = hn::Set(d, 2.0);
  const auto six = hn::Set(d, 6.0);
  const auto below = hn::Sub(t, one);
  const auto far_below = hn::Sub(t, two);
  const auto above = hn::Add(t, one);
  weights[0] = hn::Div(hn::Mul(hn::Mul(hn::Neg(t), below), far_below), six);
  weights[1] = hn::Div(hn::Mul(hn::Mul(above, below), far_below), two);
  weights[2] = hn::Div(hn::Mul(hn::Mul(hn::Neg(above), t), far_below), two);
  weights[3] = hn::Div(hn::Mul(hn::Mul(above, t), below), six);
}

/// Lanes are points.
void weigh(const GridPoints& points, std::size_t columns, PointWeights& found) {
  using D = hn::CappedTag<double, 8>;
  const D d;
  const hn::Rebind<float, D> single;
  for (std::size_t p = 0; p < GridPoints::kCount; p += hn::MaxLanes(d)) {
    const auto column = hn::LoadU(d, points.column.data() + p);
    const auto row = hn::LoadU(d, points.row.data() + p);
    hn::Vec<D> along_x[4];
    hn::Vec<D> along_y[4];
    cubic_weights_of(d, hn::Sub(column, hn::Floor(column)), along_x);
    cubic_weights_of(d, hn::Sub(row, hn::Floor(row)), along_y);
    for (std::size_t b = 0; b < 4; ++b) {
      for (std::size_t a = 0; a < 4; ++a) {
        hn::StoreU(hn::DemoteTo(single, hn::Mul(along_x[a], along_y[b])), single,
                   found.weight[4 * b + a] + p);
      }
    }
  }
  for (std::size_t p = 0; p < GridPoints::kCount; ++p) {
    found.first[p] = (static_cast<std::size_t>(points.row[p]) - 1) * columns +
                     static_cast<std::size_t>(points.column[p]) - 1;
  }
}

/// Lanes are the values of a node.
void interpolate_energies(const EnergyNode* nodes, std::size_t columns, const GridPoints& points,
                          std::array<EnergyNode, GridPoints::kCount>& totals) {
  using D = hn::CappedTag<float, 4>;
  constexpr int kVectors = static_cast<int>(4 / hn::MaxLanes(D()));
  using Math = SideBySide<D, kVectors>;
  PointWeights weights;
  weigh(points, columns, weights);
  for (const std::size_t first : weights.first) {  // most nodes are in no cache
    for (std::size_t b = 0; b < 4; ++b) {
      hwy::Prefetch(nodes + first + b * columns);
      hwy::Prefetch(nodes + first + b * columns + 3);
    }
  }
  for (std::size_t p = 0; p < GridPoints::kCount; ++p) {
    VectorPack<D, kVectors> sum;
    for (int j = 0; j < kVectors; ++j) sum.v[j] = hn::Zero(D());
    for (std::size_t b = 0; b < 4; ++b) {
      const EnergyNode* const row = nodes + weights.first[p] + b * columns;
      for (std::size_t a = 0; a < 4; ++a) {
        const auto weight = hn::Set(D(), weights.weight[4 * b + a][p]);
        sum = Math::add(sum, Math::mul(Math::load(row[a].values.data()), weight));
      }
    }
    Math::store(sum, totals[p].values.data());
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

void interpolate(const EnergyNode* nodes, std::size_t columns, const GridPoints& points,
                 std::array<EnergyNode, GridPoints::kCount>& totals) noexcept {
  HWY_DYNAMIC_DISPATCH(interpolate_energies)(nodes, columns, points, totals);
}

}  // namespace merkel
#endif
