#include "core/contact/neighbour_depths.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

constexpr int kMaxRounds = 64;
constexpr double kTolerance_mm = 1e-7;

}  // namespace

void solve_neighbour_depths(std::span<NeighbourPress> presses) noexcept {
  for (int round = 0; round < kMaxRounds; ++round) {
    double largest_change_mm = 0.0;
    for (NeighbourPress& own : presses) {
      double displaced_mm = 0.0;
      for (const NeighbourPress& other : presses) {
        if (&other == &own || !other.press.touching()) continue;
        displaced_mm += other.tip->displacement_mm(other.press, own.press.x_mm, own.press.y_mm);
      }
      const double before_mm = own.press.contact.depth_mm;
      own.press =
          own.tip->press_at_depth(own.input, std::max(0.0, own.input.depth_mm - displaced_mm));
      largest_change_mm =
          std::max(largest_change_mm, std::fabs(own.press.contact.depth_mm - before_mm));
    }
    if (largest_change_mm <= kTolerance_mm) return;
  }
}

}  // namespace merkel
