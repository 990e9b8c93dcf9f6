// Standard normal numbers for a block of neurons: normal_random(), to the last bit, as vectors.
#if defined(CORE_NEURON_KERNEL_NORMAL_NOISE_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CORE_NEURON_KERNEL_NORMAL_NOISE_INL_HPP
#undef CORE_NEURON_KERNEL_NORMAL_NOISE_INL_HPP
#else
#define CORE_NEURON_KERNEL_NORMAL_NOISE_INL_HPP
#endif

#include <cstddef>
#include <cstdint>
#include <numbers>

#include <hwy/highway.h>

#include "core/math/normal_random.hpp"
#include "core/math/random.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct NormalNoise {
  using V = hn::Vec<D>;
  using U = hn::RebindToUnsigned<D>;
  using Word = hn::Vec<U>;

  static HWY_INLINE V set(double value) { return hn::Set(D(), value); }
  static HWY_INLINE Word set(std::uint64_t value) { return hn::Set(U(), value); }

  /// The low 64 bits of a·b, from products of 32 bits: most instruction sets have no other.
  static HWY_INLINE Word times(Word a, std::uint64_t factor) {
#if HWY_TARGET == HWY_SCALAR
    return set(hn::GetLane(a) * factor);
#else
    const hn::Repartition<std::uint32_t, U> half;
    const Word b = set(factor);
    const auto product = [&](Word x, Word y) HWY_ATTR {
      return hn::MulEven(hn::BitCast(half, x), hn::BitCast(half, y));
    };
    const Word low = product(a, b);
    const Word crossed =
        hn::Add(product(hn::ShiftRight<32>(a), b), product(a, hn::ShiftRight<32>(b)));
    return hn::Add(low, hn::ShiftLeft<32>(crossed));
#endif
  }
  /// Random::mix.
  static HWY_INLINE Word mix(Word z) {
    z = times(hn::Xor(z, hn::ShiftRight<30>(z)), 0xbf58476d1ce4e5b9U);
    z = times(hn::Xor(z, hn::ShiftRight<27>(z)), 0x94d049bb133111ebU);
    return hn::Xor(z, hn::ShiftRight<31>(z));
  }
  static HWY_INLINE V multiply_add(V a, V b, V c) { return hn::Add(hn::Mul(a, b), c); }

  template <std::size_t kCount>
  static HWY_INLINE V horner(const double (&series)[kCount], V x) {
    V sum = set(series[0]);
    for (std::size_t k = 1; k < kCount; ++k) sum = multiply_add(sum, x, set(series[k]));
    return sum;
  }

  static HWY_INLINE V logarithm(V x) {
    const Word border = set(0x3fe6a09e00000000U);
    const Word shifted = hn::Add(hn::BitCast(U(), x), hn::Sub(set(0x3ff0000000000000U), border));
    // A whole number below 2^52 in the low bits of 2^52 is that number more.
    const V e =
        hn::Sub(hn::BitCast(D(), hn::Or(hn::ShiftRight<52>(shifted), set(0x4330000000000000U))),
                set(4503599627370496.0 + 1023.0));
    const V m = hn::BitCast(D(), hn::Add(hn::And(shifted, set(0x000fffffffffffffU)), border));
    const V one = set(1.0);
    const V s = hn::Div(hn::Sub(m, one), hn::Add(m, one));
    const V z = hn::Mul(s, s);
    V sum = set(1.0 / 19);
    for (int k = 17; k >= 1; k -= 2) sum = multiply_add(sum, z, set(1.0 / k));
    return hn::Add(hn::Mul(e, set(std::numbers::ln2)), hn::Mul(hn::Add(s, s), sum));
  }

  /// The numbers of the streams [0, 16) of a block in step `step`.
  /// \param keys  normal_key of the block's eight pairs
  static HWY_INLINE void fill(const std::uint64_t* keys, std::uint64_t step, double* normals) {
    static_assert(hn::MaxLanes(D()) <= NormalStream::kDistance);
    for (std::size_t i = 0; i < NormalStream::kDistance; i += hn::Lanes(D())) {
      const Word word =
          mix(hn::Add(hn::LoadU(U(), keys + i), set((step + 1) * Random::kIncrement)));
      const Word one_bits = set(0x3ff0000000000000U);
      const V u =
          hn::Sub(set(2.0),
                  hn::BitCast(D(), hn::Or(hn::ShiftLeft<20>(hn::ShiftRight<32>(word)), one_bits)));
      const V turns =
          hn::Sub(hn::BitCast(D(), hn::Or(hn::ShiftRight<12>(hn::ShiftLeft<32>(word)), one_bits)),
                  set(1.0));
      const V radius = hn::Sqrt(hn::Mul(set(-2.0), logarithm(u)));
      const V quarters = hn::Mul(set(4.0), turns);
      const V q = hn::Floor(hn::Add(quarters, set(0.5)));
      const V f = hn::Mul(hn::Sub(quarters, q), set(0.5 * std::numbers::pi));
      const V f2 = hn::Mul(f, f);
      const V sine = hn::Mul(horner(kSineSeries, f2), f);
      const V cosine = horner(kCosineSeries, f2);
      const auto is = [&](double value) HWY_ATTR { return hn::Eq(q, set(value)); };
      const auto odd = hn::Or(is(1.0), is(3.0));
      const V first = hn::IfThenElse(odd, sine, cosine);
      const V second = hn::IfThenElse(odd, cosine, sine);
      const V first_signed = hn::IfThenElse(hn::Or(is(1.0), is(2.0)), hn::Neg(first), first);
      const V second_signed = hn::IfThenElse(hn::Or(is(2.0), is(3.0)), hn::Neg(second), second);
      hn::StoreU(hn::Mul(radius, first_signed), D(), normals + i);
      hn::StoreU(hn::Mul(radius, second_signed), D(), normals + NormalStream::kDistance + i);
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#endif
