// Vector arithmetic that gives the same bits on every instruction set. The kernels include it once
// per target, so it uses Highway's guard instead of #pragma once.
#if defined(CORE_SIMD_VECTOR_MATH_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CORE_SIMD_VECTOR_MATH_INL_HPP
#undef CORE_SIMD_VECTOR_MATH_INL_HPP
#else
#define CORE_SIMD_VECTOR_MATH_INL_HPP
#endif

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// For lambda expressions in innermost loops: compiled for the target and always inlined.
#undef MERKEL_INLINE_LAMBDA
#define MERKEL_INLINE_LAMBDA HWY_ATTR __attribute__((always_inline))

/// kCount vectors that undergo the same arithmetic side by side. The operations on one vector
/// depend on each other; those on the other vectors fill the pipeline. Each lane's result is the
/// same as for one vector.
template <class D, int kCount>
struct VectorPack {
  hn::Vec<D> v[kCount];
};
template <class D, int kCount>
struct MaskPack {
  hn::Mask<D> v[kCount];
};

/// The operand for vector j of a pack: its own vector, or a constant that all vectors share.
template <class V>
HWY_INLINE V lane_pack(V constant, int) {
  return constant;
}
template <class D, int kCount>
HWY_INLINE hn::Vec<D> lane_pack(const VectorPack<D, kCount>& x, int j) {
  return x.v[j];
}
template <class D, int kCount>
HWY_INLINE hn::Mask<D> lane_pack(const MaskPack<D, kCount>& x, int j) {
  return x.v[j];
}

#define MERKEL_SIDE_BY_SIDE(result, expression) \
  for (int j = 0; j < kCount; ++j) (result).v[j] = (expression);

/// The floating-point operations of the kernels, on kCount vectors of D side by side. An operand
/// may be a VectorPack or one constant vector. Integer lanes use Highway itself.
template <class D, int kCount>
struct SideBySide {
  using T = hn::TFromD<D>;
  using V = hn::Vec<D>;
  using X = VectorPack<D, kCount>;
  using M = MaskPack<D, kCount>;

  static HWY_INLINE X load(const T* from) {
    const D d;
    X r;
    MERKEL_SIDE_BY_SIDE(r, hn::LoadU(d, from + static_cast<std::size_t>(j) * hn::Lanes(d)));
    return r;
  }
  static HWY_INLINE void store(const X& x, T* to) {
    const D d;
    for (int j = 0; j < kCount; ++j) {
      hn::StoreU(x.v[j], d, to + static_cast<std::size_t>(j) * hn::Lanes(d));
    }
  }
#define MERKEL_LANEWISE(result, name, operation)                             \
  template <class A, class B>                                                \
  static HWY_INLINE result name(const A& a, const B& b) {                    \
    result r;                                                                \
    MERKEL_SIDE_BY_SIDE(r, hn::operation(lane_pack(a, j), lane_pack(b, j))); \
    return r;                                                                \
  }
  MERKEL_LANEWISE(X, add, Add)
  MERKEL_LANEWISE(X, sub, Sub)
  MERKEL_LANEWISE(X, mul, Mul)
  MERKEL_LANEWISE(X, div, Div)
  MERKEL_LANEWISE(X, min, Min)
  MERKEL_LANEWISE(X, max, Max)
  MERKEL_LANEWISE(M, less, Lt)
  MERKEL_LANEWISE(M, at_least, Ge)
  MERKEL_LANEWISE(M, equal, Eq)
#undef MERKEL_LANEWISE
#define MERKEL_LANEWISE(type, name, operation)     \
  static HWY_INLINE type name(const type& a) {     \
    type r;                                        \
    MERKEL_SIDE_BY_SIDE(r, hn::operation(a.v[j])); \
    return r;                                      \
  }
  MERKEL_LANEWISE(X, abs, Abs)
  MERKEL_LANEWISE(X, neg, Neg)
  MERKEL_LANEWISE(X, sqrt, Sqrt)
  MERKEL_LANEWISE(X, floor, Floor)
  MERKEL_LANEWISE(M, inverse, Not)
#undef MERKEL_LANEWISE
  /// before < threshold and not after < threshold: an upward crossing, or a non-finite state.
  static HWY_INLINE M rises(const X& before, const X& after, V threshold) {
    M r;
    MERKEL_SIDE_BY_SIDE(r,
                        hn::AndNot(hn::Lt(after.v[j], threshold), hn::Lt(before.v[j], threshold)));
    return r;
  }
  static HWY_INLINE M either(const M& a, const M& b) {
    M r;
    MERKEL_SIDE_BY_SIDE(r, hn::Or(a.v[j], b.v[j]));
    return r;
  }
  template <class A, class B>
  static HWY_INLINE X select(const M& mask, const A& yes, const B& no) {
    X r;
    MERKEL_SIDE_BY_SIDE(r, hn::IfThenElse(mask.v[j], lane_pack(yes, j), lane_pack(no, j)));
    return r;
  }
  /// Whether any lane of any mask is set.
  static HWY_INLINE bool any(const M& mask) {
    const D d;
    hn::Mask<D> all = mask.v[0];
    for (int j = 1; j < kCount; ++j) all = hn::Or(all, mask.v[j]);
    return !hn::AllFalse(d, all);
  }
  /// a·b + c with one rounding, on every target. Where the instruction set has no such instruction
  /// (plain scalar), the C library computes it lane by lane: slow, but bit-identical.
  template <class A, class B, class C>
  static HWY_INLINE X fused(const A& a, const B& b, const C& c) {
    X r;
#if HWY_NATIVE_FMA
    MERKEL_SIDE_BY_SIDE(r, hn::MulAdd(lane_pack(a, j), lane_pack(b, j), lane_pack(c, j)));
#else
    MERKEL_SIDE_BY_SIDE(r, fused_by_lane(lane_pack(a, j), lane_pack(b, j), lane_pack(c, j)));
#endif
    return r;
  }
  /// c − a·b with one rounding.
  template <class A, class B, class C>
  static HWY_INLINE X fused_negative(const A& a, const B& b, const C& c) {
    X r;
#if HWY_NATIVE_FMA
    MERKEL_SIDE_BY_SIDE(r, hn::NegMulAdd(lane_pack(a, j), lane_pack(b, j), lane_pack(c, j)));
#else
    MERKEL_SIDE_BY_SIDE(r,
                        fused_by_lane(hn::Neg(lane_pack(a, j)), lane_pack(b, j), lane_pack(c, j)));
#endif
    return r;
  }
  static HWY_INLINE V constant(double value) { return hn::Set(D(), static_cast<T>(value)); }

  /// Σ c_k x^k by Horner's rule; the coefficients begin with c_0.
  template <std::size_t kCoefficients>
  static HWY_INLINE X polynomial(const X& x, const double (&c)[kCoefficients]) {
    X sum = fused(x, constant(c[kCoefficients - 1]), constant(c[kCoefficients - 2]));
    for (std::size_t k = kCoefficients - 2; k-- > 0;) sum = fused(sum, x, constant(c[k]));
    return sum;
  }

  /// e^x, to 2 units in the last place; saturates at ±708 (double) or ±87 (float).
  /// e^x = 2^k·e^r, |r| ≤ ln2/2, by Taylor's series.
  static HWY_INLINE X exponential(const X& argument) {
    constexpr bool kDouble = sizeof(T) == 8;
    constexpr int kMantissa = kDouble ? 52 : 23;
    constexpr double kLimit = kDouble ? 708.0 : 87.0;
    // Adding 1.5·2^mantissa rounds to an integer and leaves it in the low bits.
    const V shift = constant(kDouble ? 6755399441055744.0 : 12582912.0);
    const X x = min(max(argument, constant(-kLimit)), constant(kLimit));
    const X shifted = fused(x, constant(1.4426950408889634074), shift);
    const X k = sub(shifted, shift);
    X r = fused_negative(k, constant(kDouble ? 6.93147180369123816490e-01 : 0.693359375), x);
    r = fused_negative(k, constant(kDouble ? 1.90821492927058770002e-10 : -2.12194440054690583e-4),
                       r);
    X sum;
    if constexpr (kDouble) {
      constexpr double kTaylor[] = {1.0,
                                    1.0,
                                    1.0 / 2,
                                    1.0 / 6,
                                    1.0 / 24,
                                    1.0 / 120,
                                    1.0 / 720,
                                    1.0 / 5040,
                                    1.0 / 40320,
                                    1.0 / 362880,
                                    1.0 / 3628800,
                                    1.0 / 39916800,
                                    1.0 / 479001600,
                                    1.0 / 6227020800.0};
      sum = polynomial(r, kTaylor);
    } else {
      constexpr double kTaylor[] = {1.0,      1.0,       1.0 / 2,   1.0 / 6,
                                    1.0 / 24, 1.0 / 120, 1.0 / 720, 1.0 / 5040};
      sum = polynomial(r, kTaylor);
    }
    const hn::RebindToUnsigned<D> du;
    using U = hn::TFromD<decltype(du)>;
    const auto bias = hn::Set(du, static_cast<U>(kDouble ? 1023 : 127));
    X power;
    MERKEL_SIDE_BY_SIDE(
        power,
        hn::BitCast(D(), hn::ShiftLeft<kMantissa>(hn::Add(hn::BitCast(du, shifted.v[j]), bias))));
    return mul(sum, power);
  }

 private:
#if !HWY_NATIVE_FMA
  static HWY_NOINLINE V fused_by_lane(V a, V b, V c) {
    const D d;
    HWY_ALIGN T x[hn::MaxLanes(d)];
    HWY_ALIGN T y[hn::MaxLanes(d)];
    HWY_ALIGN T z[hn::MaxLanes(d)];
    hn::Store(a, d, x);
    hn::Store(b, d, y);
    hn::Store(c, d, z);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) x[i] = std::fma(x[i], y[i], z[i]);
    return hn::Load(d, x);
  }
#endif
};

#undef MERKEL_SIDE_BY_SIDE

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#endif
