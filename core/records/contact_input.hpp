#pragma once

#include <type_traits>

namespace merkel {

/// The input of one probe to the skin at one instant: plain data.
struct ContactInput {
  double depth_mm = 0.0;  ///< indentation depth; ≤ 0: no contact
  double force_mN = 0.0;  ///< used instead of the depth by a force-controlled indenter
  double x_mm = 0.0;      ///< position of the indenter's axis on the patch
  double y_mm = 0.0;

  friend bool operator==(const ContactInput&, const ContactInput&) = default;
};

static_assert(std::is_trivially_copyable_v<ContactInput>);

}  // namespace merkel
