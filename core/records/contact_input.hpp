#pragma once

#include <type_traits>

namespace merkel {

/// What one probe does to the skin at one instant: plain data.
struct ContactInput {
  double depth_mm = 0.0;  ///< indentation depth; ≤ 0 is no contact
  double force_mN = 0.0;  ///< used instead of the depth by a force-controlled indenter
  double x_mm = 0.0;      ///< where the axis of the indenter meets the patch
  double y_mm = 0.0;

  friend bool operator==(const ContactInput&, const ContactInput&) = default;
};

static_assert(std::is_trivially_copyable_v<ContactInput>);

}  // namespace merkel
