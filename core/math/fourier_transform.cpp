#include "core/math/fourier_transform.hpp"

#include <cassert>
#include <numbers>
#include <utility>

namespace merkel {
namespace {

/// cos and sin of an angle from 0 to π/4, by their series.
std::pair<double, double> cos_sin(double x) {
  double cosine = 1.0;
  double sine = 1.0;
  for (int k = 10; k >= 1; --k) {
    cosine = 1.0 - x * x / static_cast<double>((2 * k - 1) * (2 * k)) * cosine;
    sine = 1.0 - x * x / static_cast<double>((2 * k) * (2 * k + 1)) * sine;
  }
  return {cosine, x * sine};
}

/// cos and sin of 2π·k/n.
std::pair<double, double> cos_sin_of_turn(std::size_t k, std::size_t n) {
  const std::size_t eighths = 8 * k / n;
  const auto angle = [n](std::size_t part) {
    return 2.0 * std::numbers::pi * static_cast<double>(part) / static_cast<double>(n);
  };
  if (eighths == 0) return cos_sin(angle(k));
  if (eighths == 1) {
    const auto [c, s] = cos_sin(angle(n / 4 - k));
    return {s, c};
  }
  if (eighths < 4) {
    const auto [c, s] = cos_sin_of_turn(k - n / 4, n);
    return {-s, c};
  }
  const auto [c, s] = cos_sin_of_turn(k - n / 2, n);
  return {-c, -s};
}

/// Where a step reads and writes.
struct Complex {
  double* re;
  double* im;
  [[nodiscard]] Complex at(std::size_t offset) const { return {re + offset, im + offset}; }
};

void radix_4(const Complex& from, const Complex& to, std::size_t quarter, std::size_t stride,
             const double (&wr)[3], const double (&wi)[3]) {
  const Complex a = from;
  const Complex b = from.at(quarter);
  const Complex c = from.at(2 * quarter);
  const Complex d = from.at(3 * quarter);
  double* __restrict r0 = to.re;
  double* __restrict i0 = to.im;
  double* __restrict r1 = to.re + stride;
  double* __restrict i1 = to.im + stride;
  double* __restrict r2 = to.re + 2 * stride;
  double* __restrict i2 = to.im + 2 * stride;
  double* __restrict r3 = to.re + 3 * stride;
  double* __restrict i3 = to.im + 3 * stride;
  for (std::size_t q = 0; q < stride; ++q) {
    const double sum_re = a.re[q] + c.re[q];
    const double sum_im = a.im[q] + c.im[q];
    const double difference_re = a.re[q] - c.re[q];
    const double difference_im = a.im[q] - c.im[q];
    const double other_re = b.re[q] + d.re[q];
    const double other_im = b.im[q] + d.im[q];
    const double turned_re = d.im[q] - b.im[q];  // i·(b − d)
    const double turned_im = b.re[q] - d.re[q];
    r0[q] = sum_re + other_re;
    i0[q] = sum_im + other_im;
    const double x1 = difference_re - turned_re;
    const double y1 = difference_im - turned_im;
    r1[q] = x1 * wr[0] - y1 * wi[0];
    i1[q] = x1 * wi[0] + y1 * wr[0];
    const double x2 = sum_re - other_re;
    const double y2 = sum_im - other_im;
    r2[q] = x2 * wr[1] - y2 * wi[1];
    i2[q] = x2 * wi[1] + y2 * wr[1];
    const double x3 = difference_re + turned_re;
    const double y3 = difference_im + turned_im;
    r3[q] = x3 * wr[2] - y3 * wi[2];
    i3[q] = x3 * wi[2] + y3 * wr[2];
  }
}

void radix_2(const Complex& from, const Complex& to, std::size_t stride) {
  for (std::size_t q = 0; q < stride; ++q) {
    to.re[q] = from.re[q] + from.re[q + stride];
    to.im[q] = from.im[q] + from.im[q + stride];
    to.re[q + stride] = from.re[q] - from.re[q + stride];
    to.im[q + stride] = from.im[q] - from.im[q + stride];
  }
}

}  // namespace

FourierTransform::FourierTransform(std::size_t length) : length_(length) {
  assert(length >= 4 && (length & (length - 1)) == 0);
  twiddles_.reserve(length);
  for (std::size_t k = 0; k < length; ++k) {
    const auto [c, s] = cos_sin_of_turn(k, length);
    twiddles_.push_back({c, -s});
  }
}

void FourierTransform::forward(double* re, double* im, std::size_t count, double* work_re,
                               double* work_im) const noexcept {
  Complex from{re, im};
  Complex to{work_re, work_im};
  std::size_t stride = count;
  for (std::size_t left = length_; left > 1;) {
    if (left == 2) {
      radix_2(from, to, stride);
      left = 1;
    } else {
      const std::size_t step = length_ / left;
      for (std::size_t p = 0; p < left / 4; ++p) {
        const Twiddle& w1 = twiddles_[p * step];
        const Twiddle& w2 = twiddles_[2 * p * step];
        const Twiddle& w3 = twiddles_[3 * p * step];
        radix_4(from.at(p * stride), to.at(4 * p * stride), left / 4 * stride, stride,
                {w1.re, w2.re, w3.re}, {w1.im, w2.im, w3.im});
      }
      left /= 4;
      stride *= 4;
    }
    std::swap(from, to);
  }
  if (from.re != re) {
    for (std::size_t k = 0; k < length_ * count; ++k) {
      re[k] = from.re[k];
      im[k] = from.im[k];
    }
  }
}

}  // namespace merkel
