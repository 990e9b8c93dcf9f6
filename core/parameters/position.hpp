#pragma once

namespace merkel {

/// A point of a patch of skin, in its coordinates: x from the fingertip along the finger, y across.
struct Position {
  double x_mm = 0.0;
  double y_mm = 0.0;
};

}  // namespace merkel
