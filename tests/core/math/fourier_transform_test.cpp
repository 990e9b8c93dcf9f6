#include "core/math/fourier_transform.hpp"

#include <complex>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/every_simd_target.hpp"

namespace merkel {
namespace {

double sample(std::size_t k) { return static_cast<double>((k * 2654435761U) % 1000) / 500.0 - 1.0; }

TEST(FourierTransform, EqualsTheSumOfItsDefinition) {
  constexpr std::size_t kCount = 3;
  for (const std::size_t n : {4U, 8U, 32U, 128U}) {
    const FourierTransform transform(n);
    std::vector<double> re(n * kCount), im(n * kCount), work_re(n * kCount), work_im(n * kCount);
    for (std::size_t i = 0; i < n * kCount; ++i) {
      re[i] = sample(i);
      im[i] = sample(i + 1000);
    }
    const auto x = re;
    const auto y = im;
    transform.forward(re.data(), im.data(), kCount, work_re.data(), work_im.data());
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t s = 0; s < kCount; ++s) {
        std::complex<double> sum;
        for (std::size_t j = 0; j < n; ++j) {
          const double angle =
              -2.0 * std::numbers::pi * static_cast<double>(j * k % n) / static_cast<double>(n);
          sum += std::complex(x[j * kCount + s], y[j * kCount + s]) * std::polar(1.0, angle);
        }
        EXPECT_NEAR(re[k * kCount + s], sum.real(), 1e-13 * static_cast<double>(n))
            << n << " " << k;
        EXPECT_NEAR(im[k * kCount + s], sum.imag(), 1e-13 * static_cast<double>(n))
            << n << " " << k;
      }
    }
    transform.inverse(re.data(), im.data(), kCount, work_re.data(), work_im.data());
    for (std::size_t i = 0; i < n * kCount; ++i) {
      EXPECT_NEAR(re[i] / static_cast<double>(n), x[i], 1e-14);
      EXPECT_NEAR(im[i] / static_cast<double>(n), y[i], 1e-14);
    }
  }
}

TEST(FourierTransform, HasTheSameBitsOnEveryInstructionSet) {
  constexpr std::size_t kCount = 8;
  for (const std::size_t n : {64U, 128U}) {
    const FourierTransform transform(n);
    on_every_simd_target([&] {
      std::vector<double> re(n * kCount), im(n * kCount), work_re(n * kCount), work_im(n * kCount);
      for (std::size_t i = 0; i < n * kCount; ++i) {
        re[i] = sample(i);
        im[i] = sample(i + 1000);
      }
      transform.forward(re.data(), im.data(), kCount, work_re.data(), work_im.data());
      return std::pair(re, im);
    });
  }
}

}  // namespace
}  // namespace merkel
