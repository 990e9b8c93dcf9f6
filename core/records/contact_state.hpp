#pragma once

namespace merkel {

/// The contact of a tip with the skin at one instant. All zero when not touching. A sphere's
/// pressure is p(r) = p0·√(1−r²/a²), r ≤ a; a solved contact sets depth and force only.
struct ContactState {
  double depth_mm = 0.0;           ///< d, indentation depth
  double force_mN = 0.0;           ///< F
  double contact_radius_mm = 0.0;  ///< a
  double peak_pressure_kPa = 0.0;  ///< p0
  double stiffening = 1.0;         ///< of the skin at this depth: its moduli over those at rest

  [[nodiscard]] bool touching() const noexcept { return contact_radius_mm > 0.0; }

  friend bool operator==(const ContactState&, const ContactState&) = default;
};

/// The contact of any tip with the skin at one instant.
struct Press {
  ContactState contact;
  double x_mm = 0.0;  ///< of the contact's centre
  double y_mm = 0.0;

  /// A tactile array presses without a depth.
  [[nodiscard]] bool touching() const noexcept {
    return contact.depth_mm > 0.0 || contact.peak_pressure_kPa > 0.0;
  }
};

}  // namespace merkel
