#pragma once

#include <array>

namespace merkel {

/// Weights of the cubic through the points −1, 0, 1, 2 at t in [0, 1]. Real-time: yes.
[[nodiscard]] constexpr std::array<double, 4> cubic_weights(double t) noexcept {
  return {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
          -(t + 1.0) * t * (t - 2.0) / 2.0, (t + 1.0) * t * (t - 1.0) / 6.0};
}

}  // namespace merkel
