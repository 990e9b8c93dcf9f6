#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/contact/kernel/taxel_kernel.cpp"
#include "core/contact/kernel/taxel_kernel.hpp"

#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target
#include <hwy/highway.h>

#include "core/simd/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

void multiply_block(const ProductBlock& block) {
  using D = hn::CappedTag<float, kProductColumns>;
  using Math = SideBySide<D, 1>;
  using X = VectorPack<D, 1>;
  const std::size_t lanes = hn::Lanes(D());
  for (std::size_t j = 0; j < block.columns; j += lanes) {
    X sum[kProductRows];
    for (X& each : sum) each.v[0] = hn::Zero(D());
    for (const std::uint32_t term : block.terms) {
      const X row = Math::load(block.rows + term * block.columns + j);
      const float* const factors = block.factors + term * kProductRows;
      for (std::size_t q = 0; q < kProductRows; ++q) {
        sum[q] = Math::fused(row, hn::Set(D(), factors[q]), sum[q]);
      }
    }
    for (std::size_t q = 0; q < kProductRows; ++q) {
      Math::store(sum[q], block.out + q * block.columns + j);
    }
  }
}

void energies_of_nodes(const NodeStresses& s, std::size_t count, float* energies) {
  using D = hn::CappedTag<float, kProductColumns>;
  using Math = SideBySide<D, 1>;
  using X = VectorPack<D, 1>;
  for (std::size_t i = 0; i < count; i += hn::Lanes(D())) {
    const auto at = [&](std::size_t k) HWY_ATTR { return Math::load(s.of[k] + i); };
    const X x = at(0);
    const X y = at(1);
    const X z = at(2);
    const auto square = [](const X& a) HWY_ATTR { return Math::mul(a, a); };
    const X shear2 = Math::add(square(at(3)), Math::add(square(at(4)), square(at(5))));
    const X normal2 = Math::add(square(Math::sub(x, y)),
                                Math::add(square(Math::sub(y, z)), square(Math::sub(z, x))));
    const X sum = Math::add(normal2, Math::mul(shear2, hn::Set(D(), 6.0F)));
    const X trace2 = square(Math::add(x, Math::add(y, z)));
    Math::store(Math::add(Math::mul(sum, hn::Set(D(), s.distortional)),
                          Math::mul(trace2, hn::Set(D(), s.volumetric))),
                energies + i);
  }
}

void values_at_points(const GridPoint* points, std::size_t count, const float* grid,
                      std::size_t columns, float* values) {
  using D = hn::CappedTag<float, 4>;
  constexpr int kVectors = static_cast<int>(4 / hn::MaxLanes(D()));
  const D d;
  for (std::size_t i = 0; i < count; ++i) {
    const GridPoint& point = points[i];
    HWY_ALIGN float along_y[4];
    for (int j = 0; j < kVectors; ++j) {
      const std::size_t lane = static_cast<std::size_t>(j) * hn::Lanes(d);
      auto sum = hn::Zero(d);
      for (std::size_t a = 0; a < 4; ++a) {
        const auto node = hn::LoadU(d, grid + point.first + a * columns + lane);
        sum = hn::Add(sum, hn::Mul(node, hn::Set(d, point.along_x[a])));
      }
      hn::Store(hn::Mul(sum, hn::LoadU(d, point.along_y + lane)), d, along_y + lane);
    }
    const float value = (along_y[0] + along_y[1]) + (along_y[2] + along_y[3]);
    values[i] = value > 0.0F ? value : 0.0F;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(multiply_block);
HWY_EXPORT(energies_of_nodes);
HWY_EXPORT(values_at_points);

void multiply(const ProductBlock& block) noexcept { HWY_DYNAMIC_DISPATCH(multiply_block)(block); }

void node_energies(const NodeStresses& stresses, std::size_t count, float* energies) noexcept {
  HWY_DYNAMIC_DISPATCH(energies_of_nodes)(stresses, count, energies);
}

void interpolate_points(std::span<const GridPoint> points, const float* grid, std::size_t columns,
                        float* values) noexcept {
  HWY_DYNAMIC_DISPATCH(values_at_points)(points.data(), points.size(), grid, columns, values);
}

}  // namespace merkel
#endif
