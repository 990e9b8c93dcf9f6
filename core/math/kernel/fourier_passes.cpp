#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/math/kernel/fourier_passes.cpp"
#include "core/math/kernel/fourier_passes.hpp"

#include <utility>

#include <hwy/foreach_target.h>  // before the kernels: compiles this file once for each target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// One butterfly of radix 4 for `stride` neighbouring elements, a whole number of vectors.
template <class D>
void radix_4(D d, const double* from_re, const double* from_im, std::size_t quarter, double* to_re,
             double* to_im, std::size_t stride, const Twiddle& w1, const Twiddle& w2,
             const Twiddle& w3) {
  const auto turn = [d](auto re, auto im, const Twiddle& w, double* at_re, double* at_im) {
    const auto wr = hn::Set(d, w.re);
    const auto wi = hn::Set(d, w.im);
    hn::StoreU(hn::Sub(hn::Mul(re, wr), hn::Mul(im, wi)), d, at_re);
    hn::StoreU(hn::Add(hn::Mul(re, wi), hn::Mul(im, wr)), d, at_im);
  };
  for (std::size_t q = 0; q < stride; q += hn::Lanes(d)) {
    const auto a_re = hn::LoadU(d, from_re + q);
    const auto a_im = hn::LoadU(d, from_im + q);
    const auto b_re = hn::LoadU(d, from_re + quarter + q);
    const auto b_im = hn::LoadU(d, from_im + quarter + q);
    const auto c_re = hn::LoadU(d, from_re + 2 * quarter + q);
    const auto c_im = hn::LoadU(d, from_im + 2 * quarter + q);
    const auto d_re = hn::LoadU(d, from_re + 3 * quarter + q);
    const auto d_im = hn::LoadU(d, from_im + 3 * quarter + q);
    const auto sum_re = hn::Add(a_re, c_re);
    const auto sum_im = hn::Add(a_im, c_im);
    const auto difference_re = hn::Sub(a_re, c_re);
    const auto difference_im = hn::Sub(a_im, c_im);
    const auto other_re = hn::Add(b_re, d_re);
    const auto other_im = hn::Add(b_im, d_im);
    const auto turned_re = hn::Sub(d_im, b_im);  // i·(b − d)
    const auto turned_im = hn::Sub(b_re, d_re);
    hn::StoreU(hn::Add(sum_re, other_re), d, to_re + q);
    hn::StoreU(hn::Add(sum_im, other_im), d, to_im + q);
    turn(hn::Sub(difference_re, turned_re), hn::Sub(difference_im, turned_im), w1,
         to_re + stride + q, to_im + stride + q);
    turn(hn::Sub(sum_re, other_re), hn::Sub(sum_im, other_im), w2, to_re + 2 * stride + q,
         to_im + 2 * stride + q);
    turn(hn::Add(difference_re, turned_re), hn::Add(difference_im, turned_im), w3,
         to_re + 3 * stride + q, to_im + 3 * stride + q);
  }
}

template <class D>
void radix_2(D d, const double* from, double* to, std::size_t stride) {
  for (std::size_t q = 0; q < stride; q += hn::Lanes(d)) {
    const auto a = hn::LoadU(d, from + q);
    const auto b = hn::LoadU(d, from + stride + q);
    hn::StoreU(hn::Add(a, b), d, to + q);
    hn::StoreU(hn::Sub(a, b), d, to + stride + q);
  }
}

template <class D>
bool all_passes(D d, const FourierPasses& p) {
  std::pair from(p.re, p.im);
  std::pair to(p.work_re, p.work_im);
  std::size_t stride = p.count;
  bool in_work = false;
  for (std::size_t left = p.length; left > 1;) {
    if (left == 2) {
      radix_2(d, from.first, to.first, stride);
      radix_2(d, from.second, to.second, stride);
      left = 1;
    } else {
      const std::size_t step = p.length / left;
      for (std::size_t k = 0; k < left / 4; ++k) {
        radix_4(d, from.first + k * stride, from.second + k * stride, left / 4 * stride,
                to.first + 4 * k * stride, to.second + 4 * k * stride, stride, p.twiddles[k * step],
                p.twiddles[2 * k * step], p.twiddles[3 * k * step]);
      }
      left /= 4;
      stride *= 4;
    }
    std::swap(from, to);
    in_work = !in_work;
  }
  return in_work;
}

bool fourier_passes_on(const FourierPasses& passes) {
  using Wide = hn::CappedTag<double, 8>;
  return passes.count % hn::MaxLanes(Wide()) == 0 ? all_passes(Wide(), passes)
                                                  : all_passes(hn::CappedTag<double, 1>(), passes);
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merkel {

HWY_EXPORT(fourier_passes_on);

bool fourier_passes(const FourierPasses& passes) noexcept {
  return HWY_DYNAMIC_DISPATCH(fourier_passes_on)(passes);
}

}  // namespace merkel
#endif
