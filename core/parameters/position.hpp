#pragma once

namespace merkel {

/// A point on a patch of skin, in the patch's coordinates: x from the fingertip along the finger, y
/// across.
struct Position {
  double x_mm = 0.0;
  double y_mm = 0.0;

  friend bool operator==(const Position&, const Position&) = default;
};

}  // namespace merkel
