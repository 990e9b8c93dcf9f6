#pragma once

#include <cstddef>

namespace merkel {

/// e^{−2πik/n}.
struct Twiddle {
  double re, im;
};

/// Where the passes of a Fourier transform read and write: `length` elements of `count` sequences.
struct FourierPasses {
  const Twiddle* twiddles;
  std::size_t length;
  std::size_t count;
  double* re;
  double* im;
  double* work_re;
  double* work_im;
};

/// All passes of a forward transform (see FourierTransform). \return whether the result lies in the
/// work space. Bit-identical on every instruction set. Real-time: yes.
[[nodiscard]] bool fourier_passes(const FourierPasses& passes) noexcept;

}  // namespace merkel
