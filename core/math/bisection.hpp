#pragma once

namespace merkel {

/// Where a condition that holds at `low` ceases to hold on the way to `high`: the upper end of the
/// interval after 60 halvings.
template <class Below>
[[nodiscard]] double bisected(double low, double high, Below below) noexcept {
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    (below(middle) ? low : high) = middle;
  }
  return high;
}

}  // namespace merkel
