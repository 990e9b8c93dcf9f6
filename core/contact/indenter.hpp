#pragma once

#include <cstddef>
#include <limits>
#include <string_view>

#include "core/contact/tip_kinds.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The error for probes that mix depth and force control.
inline constexpr std::string_view kMixedControl =
    "must be the same for all probes, but mixes \"depth\" and \"force\": use one of them for all "
    "probes";

/// What makes a tip a surface that slides under the finger.
struct SlidingSurface {
  bool slides = false;
  double relief_mm = std::numeric_limits<double>::infinity();  ///< of its parts above a base plate
  double period_x_mm = 0.0;                                    ///< 0: does not repeat
  double period_y_mm = 0.0;
  double deepest_mm = 1.2;  ///< for which the contact has room

  [[nodiscard]] static FieldTable fields();
  friend bool operator==(const SlidingSurface&, const SlidingSurface&) = default;
};

/// The tip of a probe: rigid, or a tactile array whose pressures are prescribed.
struct Indenter {
  /// Of receptors under a solved contact.
  static constexpr double kMinDepth_mm = 0.05;

  /// Which reading of the probe drives the contact.
  enum class Control { kDepth, kForce };

  Tip tip;
  double orientation_deg = 0.0;  ///< of all tips but spheres
  double tilt_deg = 0.0;
  SlidingSurface surface;
  Control control = Control::kDepth;
  std::size_t patch = 0;  ///< index of the patch that it presses on

  /// The parameter that selects the tip. Setting another kind selects its default tip, and
  /// invalidates fields bound to the one before.
  [[nodiscard]] static FieldTable tip_field();
  /// How all tips but spheres are turned.
  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check(const SkinParameters& skin) const;

  [[nodiscard]] const SphereTip* sphere() const noexcept { return std::get_if<SphereTip>(&tip); }
  /// The array, if its pressures are measured, not computed from a contact.
  [[nodiscard]] const TaxelArray* taxels() const noexcept { return std::get_if<TaxelArray>(&tip); }
  /// Whether Hertz's closed forms describe the contact: a sphere on a half-space of one material.
  [[nodiscard]] bool closed_form(const SkinParameters& skin) const noexcept {
    return sphere() != nullptr && skin.layers.empty() && !skin.layered() &&
           skin.contact_law == ContactLaw::kHertz && !surface.slides;
  }
  /// Whether, in addition, the contact is a circle, and its stresses are Huber's.
  [[nodiscard]] bool circular(const SkinParameters& skin) const noexcept {
    return closed_form(skin) && skin.round();
  }
  /// Whether two indenters have the same tip.
  [[nodiscard]] bool same_tip(const Indenter& other) const noexcept {
    return tip == other.tip && orientation_deg == other.orientation_deg &&
           tilt_deg == other.tilt_deg && surface == other.surface;
  }
  [[nodiscard]] std::string_view tip_name() const noexcept { return kTipNames[tip.index()]; }
};

}  // namespace merkel
