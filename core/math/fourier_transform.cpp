#include "core/math/fourier_transform.hpp"

#include <algorithm>
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
  const bool in_work = fourier_passes({.twiddles = twiddles_.data(),
                                       .length = length_,
                                       .count = count,
                                       .re = re,
                                       .im = im,
                                       .work_re = work_re,
                                       .work_im = work_im});
  if (!in_work) return;
  std::copy(work_re, work_re + length_ * count, re);
  std::copy(work_im, work_im + length_ * count, im);
}

}  // namespace merkel
