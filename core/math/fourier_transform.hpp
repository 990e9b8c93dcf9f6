#pragma once

#include <cstddef>
#include <vector>

#include "core/math/kernel/fourier_passes.hpp"

namespace merkel {

/// The discrete Fourier transform of many sequences side by side: element k of sequence s is at
/// index k·count + s, so each arithmetic step runs over adjacent values. Uses only +, − and × in a
/// fixed order: every machine and C library gives the same bits. Stockham's algorithm, radix 4
/// (Van Loan, Computational Frameworks for the FFT, 1992).
/// Real-time: yes, after construction.
class FourierTransform {
 public:
  /// \param length  of a sequence: a power of two, at least 4
  explicit FourierTransform(std::size_t length);

  [[nodiscard]] std::size_t length() const noexcept { return length_; }

  /// X_k = Σ x_j·e^{−2πijk/n}, in place.
  /// \param work_re, work_im  as long as the data: length·count
  void forward(double* re, double* im, std::size_t count, double* work_re,
               double* work_im) const noexcept;
  /// x_j = Σ X_k·e^{+2πijk/n}, in place; not divided by n.
  void inverse(double* re, double* im, std::size_t count, double* work_re,
               double* work_im) const noexcept {
    forward(im, re, count, work_im, work_re);
  }

 private:
  std::size_t length_;
  std::vector<Twiddle> twiddles_;  ///< e^{−2πik/n}, k < n
};

}  // namespace merkel
