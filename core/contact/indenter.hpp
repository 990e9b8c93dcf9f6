#pragma once

#include <cstddef>
#include <string_view>

#include "core/contact/taxel_array.hpp"
#include "core/contact/tip_shape.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The error for probes that mix depth and force control.
inline constexpr std::string_view kMixedControl =
    "must be the same for all probes, but mixes \"depth\" and \"force\": use one of them for all "
    "probes";

/// The tip of a probe: rigid, or a tactile array whose pressures are prescribed.
struct Indenter {
  /// Of receptors under a solved contact.
  static constexpr double kLeastDepth_mm = 0.05;

  enum class Tip { kSphere, kBars, kPin, kEdge, kWedge, kCone, kCylinder, kDots, kShape, kTaxels };
  /// Which reading of the probe drives the contact.
  enum class Control { kDepth, kForce };

  Tip tip = Tip::kSphere;
  /// Of a sphere or cylinder; infinity is a flat plate, a sphere on curved skin only.
  double radius_mm = 2.0;
  BarTip bars;     ///< if the tip is bars
  PinTip pin;      ///< of pins, dots and cones
  TipShape shape;  ///< of all tips but spheres
  TaxelArray taxels;
  SlidingSurface surface;
  Control control = Control::kDepth;
  std::size_t patch = 0;  ///< index of the patch that it presses on

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check(const SkinParameters& skin) const;
  /// Whether Hertz's closed forms describe the contact: a sphere on a half-space of one material.
  [[nodiscard]] bool closed_form(const SkinParameters& skin) const noexcept {
    return tip == Tip::kSphere && skin.layers.empty() && !skin.layered() &&
           skin.contact_law == ContactLaw::kHertz && !surface.slides;
  }
  /// Whether, in addition, the contact is a circle, and its stresses are Huber's.
  [[nodiscard]] bool circular(const SkinParameters& skin) const noexcept {
    return closed_form(skin) && skin.round();
  }
  /// Whether its pressures are measured, not computed from a contact.
  [[nodiscard]] bool prescribed() const noexcept { return tip == Tip::kTaxels; }
  /// Whether two indenters have the same tip.
  [[nodiscard]] bool same_tip(const Indenter& other) const noexcept {
    return tip == other.tip && radius_mm == other.radius_mm && bars == other.bars &&
           pin == other.pin && shape == other.shape && taxels == other.taxels &&
           surface == other.surface;
  }
  [[nodiscard]] static std::string_view name_of(Tip tip) noexcept;
};

}  // namespace merkel
