#pragma once

namespace merkel {

/// The contact of a sphere with the skin at one instant: where its axisymmetric pressure
/// p(r) = p0·√(1−r²/a²), r ≤ a, acts. All zero when not touching.
struct SphereContact {
  double depth_mm = 0.0;           ///< d, indentation depth
  double force_mN = 0.0;           ///< F
  double contact_radius_mm = 0.0;  ///< a
  double peak_pressure_kPa = 0.0;  ///< p0

  [[nodiscard]] bool touching() const noexcept { return contact_radius_mm > 0.0; }

  friend bool operator==(const SphereContact&, const SphereContact&) = default;
};

}  // namespace merkel
