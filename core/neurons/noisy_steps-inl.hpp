// The steps of noisy neurons, and their standard normal numbers as vectors: bit-identical to
// normal_random().
#if defined(CORE_NEURONS_NOISY_STEPS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CORE_NEURONS_NOISY_STEPS_INL_HPP
#undef CORE_NEURONS_NOISY_STEPS_INL_HPP
#else
#define CORE_NEURONS_NOISY_STEPS_INL_HPP
#endif

#include <cstddef>
#include <cstdint>
#include <numbers>

#include <hwy/highway.h>

#include "core/math/normal_random.hpp"
#include "core/math/random.hpp"
#include "core/neurons/neuron_arrays.hpp"
#include "core/neurons/step_call.hpp"
#include "core/simd/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

template <class D>
struct NormalNoise {
  using Math = SideBySide<D, 1>;
  using X = VectorPack<D, 1>;
  using U = hn::RebindToUnsigned<D>;
  using Word = hn::Vec<U>;

  static HWY_INLINE Word word_of(std::uint64_t value) { return hn::Set(U(), value); }
  static HWY_INLINE X number_of(Word bits) {
    X x;
    x.v[0] = hn::BitCast(D(), bits);
    return x;
  }
  /// A uniform number in [1, 2) from 52 bits.
  static HWY_INLINE X from_mantissa(Word bits) {
    return number_of(hn::Or(bits, word_of(0x3ff0000000000000U)));
  }

  /// The low 64 bits of a·b, from 32-bit products: most instruction sets have no 64-bit product.
  static HWY_INLINE Word times(Word a, std::uint64_t factor) {
#if HWY_TARGET == HWY_SCALAR
    return word_of(hn::GetLane(a) * factor);
#else
    const hn::Repartition<std::uint32_t, U> half;
    const Word b = word_of(factor);
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
  /// Σ c_k x^k by Horner's rule with two roundings per term; the coefficients end with c_0.
  template <std::size_t kCount>
  static HWY_INLINE X horner(const double (&series)[kCount], const X& x) {
    X sum = Math::add(Math::mul(x, Math::constant(series[0])), Math::constant(series[1]));
    for (std::size_t k = 2; k < kCount; ++k) {
      sum = Math::add(Math::mul(sum, x), Math::constant(series[k]));
    }
    return sum;
  }

  static HWY_INLINE X logarithm(const X& x) {
    const Word border = word_of(0x3fe6a09e00000000U);
    const Word shifted =
        hn::Add(hn::BitCast(U(), x.v[0]), hn::Sub(word_of(0x3ff0000000000000U), border));
    // An integer n < 2^52 in the low bits of the double 2^52 gives 2^52 + n.
    const X e =
        Math::sub(number_of(hn::Or(hn::ShiftRight<52>(shifted), word_of(0x4330000000000000U))),
                  Math::constant(4503599627370496.0 + 1023.0));
    const X m = number_of(hn::Add(hn::And(shifted, word_of(0x000fffffffffffffU)), border));
    const auto one = Math::constant(1.0);
    const X s = Math::div(Math::sub(m, one), Math::add(m, one));
    const X z = Math::mul(s, s);
    X sum = Math::add(Math::mul(z, Math::constant(1.0 / 19)), Math::constant(1.0 / 17));
    for (int k = 15; k >= 1; k -= 2) sum = Math::add(Math::mul(sum, z), Math::constant(1.0 / k));
    return Math::add(Math::mul(e, Math::constant(std::numbers::ln2)),
                     Math::mul(Math::add(s, s), sum));
  }

  /// Writes the numbers of the streams [0, 16) of a block for step `step`.
  /// \param keys  normal_key of the block's eight pairs
  static HWY_INLINE void fill(const std::uint64_t* keys, std::uint64_t step, double* normals) {
    static_assert(hn::MaxLanes(D()) <= NormalStream::kDistance);
    for (std::size_t i = 0; i < NormalStream::kDistance; i += hn::Lanes(D())) {
      const Word word =
          mix(hn::Add(hn::LoadU(U(), keys + i), word_of((step + 1) * Random::kIncrement)));
      const X u = Math::sub(Math::constant(2.0),
                            from_mantissa(hn::ShiftLeft<20>(hn::ShiftRight<32>(word))));
      const X turns = Math::sub(from_mantissa(hn::ShiftRight<12>(hn::ShiftLeft<32>(word))),
                                Math::constant(1.0));
      const X radius = Math::sqrt(Math::mul(Math::constant(-2.0), logarithm(u)));
      const X quarters = Math::mul(Math::constant(4.0), turns);
      const X q = Math::floor(Math::add(quarters, Math::constant(0.5)));
      const X f = Math::mul(Math::sub(quarters, q), Math::constant(0.5 * std::numbers::pi));
      const X f2 = Math::mul(f, f);
      const X sine = Math::mul(horner(kSineSeries, f2), f);
      const X cosine = horner(kCosineSeries, f2);
      const auto is = [&](double value) HWY_ATTR { return Math::equal(q, Math::constant(value)); };
      const auto odd = Math::either(is(1.0), is(3.0));
      const X first = Math::select(odd, sine, cosine);
      const X second = Math::select(odd, cosine, sine);
      const X first_signed = Math::select(Math::either(is(1.0), is(2.0)), Math::neg(first), first);
      const X second_signed =
          Math::select(Math::either(is(2.0), is(3.0)), Math::neg(second), second);
      Math::store(Math::mul(radius, first_signed), normals + i);
      Math::store(Math::mul(radius, second_signed), normals + NormalStream::kDistance + i);
    }
  }
};

/// Takes the neurons of a call through all steps, block by block: step(i, number, phase, noise)
/// steps the vector of neurons from i on, with the input at `phase` of the call.
/// \param noise_key  of the eight pairs of neurons in each block
template <bool kNoisy, class D, class Step>
HWY_INLINE void take_noisy_steps(const StepCall& call, const std::uint64_t* noise_key,
                                 const Step& step) {
  HWY_ALIGN double noise[kNeuronBlock];
  for (std::size_t block = call.first; block < call.last; block += kNeuronBlock) {
    for (int number = 0; number < call.steps; ++number) {
      const auto phase = SideBySide<D, 1>::constant((number + 0.5) / call.steps);
      if constexpr (kNoisy) {
        NormalNoise<D>::fill(noise_key + block / 2,
                             call.steps_before + static_cast<std::uint64_t>(number), noise);
      }
      for (std::size_t i = block; i < block + kNeuronBlock; i += hn::Lanes(D())) {
        step(i, number, phase, noise + i - block);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#endif
