#pragma once

#include <limits>

#include "core/contact/bar_stress_field.hpp"
#include "core/contact/sphere_contact.hpp"

namespace merkel {

/// A contact, where on the patch its axis is, and how far it matters.
struct PlacedContact {
  SphereContact contact;                 ///< of bars, depth and force only
  const BarStressField* bars = nullptr;  ///< null for a sphere
  double x_mm = 0.0;
  double y_mm = 0.0;
  /// Beyond this distance from the axis, receptors feel next to nothing (see DriveReach).
  double reach_mm = std::numeric_limits<double>::infinity();

  friend bool operator==(const PlacedContact&, const PlacedContact&) = default;
};

}  // namespace merkel
