#pragma once

namespace merkel {

/// e^x, using only +, −, × and ÷, so every machine and C library gives the same bits. Relative
/// error below 1e-14 for |x| ≤ 40. Real-time: yes.
[[nodiscard]] double portable_exp(double x) noexcept;

/// e^x − 1, the same bits everywhere, without cancellation near 0.
[[nodiscard]] double portable_expm1(double x) noexcept;

/// The error function, the same bits everywhere. Absolute error below 1e-14. Real-time: yes.
/// erf(x) = 2/√π · x · e^{−x²} · Σ (2x²)^n / (2n+1)!!   Abramowitz & Stegun 7.1.6
[[nodiscard]] double portable_erf(double x) noexcept;

}  // namespace merkel
